"""SCENE-Net, the CNN baseline and their files (thesis 4.3, 5.2.4.2)."""
