"""Boosted trees, a baseline for SCENE-Net."""
