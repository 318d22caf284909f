"""The figures of thesis chapters 4 and 5.

``plots`` draws plain data; ``catalogue`` lists the figures of a result folder.
"""

from scenenet.figures.catalogue import CROP_RANKS, Drawing, Picture, draw_all, plan, read_pictures

__all__ = ["CROP_RANKS", "Drawing", "Picture", "draw_all", "plan", "read_pictures"]
