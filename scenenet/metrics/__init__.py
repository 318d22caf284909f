"""Scores of voxels and of tower positions (thesis 5.2.4)."""
