"""Scores of voxels and of towers (thesis 5.2.4)."""
