"""Whole surveys: tiles with halo, towers, and every point with its probability."""
