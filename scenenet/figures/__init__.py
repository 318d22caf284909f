"""The pictures of thesis chapters 4 and 5.

``charts`` and ``scenes`` draw plain data; ``plan`` says what a result folder gets.
"""

from scenenet.figures.catalogue import CROP_RANKS, Drawing, Picture, draw_all, plan, read_pictures

__all__ = ["CROP_RANKS", "Drawing", "Picture", "draw_all", "plan", "read_pictures"]
