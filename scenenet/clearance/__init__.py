"""What is near the conductors of a line, as flown, is too near, or could fall on them."""
