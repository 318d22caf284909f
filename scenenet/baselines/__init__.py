"""The boosted trees that SCENE-Net is compared with."""
