"""What is found of the lines of synthetic surveys, against the truth."""
