"""Constants of a pulse of the scanner on its way down."""

from __future__ import annotations

STEP_M = 0.36
"""Vertical length of a step of a pulse through the crowns, m."""

MOST_RETURNS = 5
"""Most returns of one pulse from foliage."""

GOES_ON = 0.42
"""Share of the pulses that continue after a return from foliage."""

FOLIAGE = 64
"""Side of the block of foliage, which is repeated, in cells."""
FOLIAGE_CELL_M = (0.28, 0.4, 0.4)
"""Size of its cells along z, y, x, m: branches spread sideways."""
FOLIATED = 0.42
"""Share of a crown that has foliage; the rest is open."""

CEILING_CELL_M = 4.0
"""Side of a cell of the map of greatest heights, at which a pulse starts its way through crowns,
m."""

GRASS_M = 0.3
"""Key points of low vegetation are in class 3 below this height, in class 4 above it, m."""
WATER_RETURNS = 0.12
"""Share of the pulses on water that return."""
BORDER_M = 0.5
"""Within this distance of the border of the corridor, m, some tall returns are unclassified."""
