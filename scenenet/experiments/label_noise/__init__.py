"""Training on labels of which a known share is wrong (thesis 5.2.5)."""
