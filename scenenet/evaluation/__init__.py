"""Scores of models on labelled crops, and their speed (thesis 5.2.4, 5.2.6)."""
