"""Scores of a trained model on labelled crops, and the time that it takes (thesis 5.2.4, 5.2.6)."""
