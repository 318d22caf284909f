"""Class codes of the returns, as the public TS40K crops have them.

When heights above the ground are compared by class, the returns of the ground stand in 10 and 19,
those of low vegetation up to about 2 m in 11 and whatever is taller in 12 and 5, houses, fences and
cables too; 2, 3 and 4 hold key points, about one per m^2, of ground, grass and scrub. That, and not
rails and roads, is what makes classes 10, 11 and 12 the bulk of thesis Table 5.1.
"""

from __future__ import annotations

UNCLASSIFIED, GROUND, GRASS, SCRUB, TREE, STRAY, WATER = 1, 2, 3, 4, 5, 7, 9
BARE, LOW, TALL, TOWER, WIRE, BARE_TOO = 10, 11, 12, 15, 16, 19

TALL_M = 2.0
"""What is higher above the ground than this is tall."""

ON_GROUND = (GROUND, GRASS, BARE, BARE_TOO, WATER)
"""Codes of what lies on the ground."""
