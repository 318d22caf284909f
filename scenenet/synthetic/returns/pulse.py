"""What happens to a pulse of the scanner on its way down."""

from __future__ import annotations

STEP_M = 0.36
"""Length of a step of a pulse through the crowns, downwards."""

MOST_RETURNS = 5
"""Of one pulse."""

GOES_ON = 0.42
"""Share of the pulses that go on behind a return from foliage."""

FOLIAGE = 64
"""Side of the block of foliage, which repeats, in cells."""
FOLIAGE_CELL_M = (0.28, 0.4, 0.4)
"""Its cells, along z, y, x: branches spread sideways."""
FOLIATED = 0.42
"""Share of a crown that has foliage; the rest lies open."""

CEILING_CELL_M = 4.0
"""Cell of the map of the tallest things around: a pulse begins its way among crowns there."""

GRASS_M = 0.3
"""Low vegetation has its key points in class 3 below this height, above it in class 4."""
WATER_RETURNS = 0.12
"""Share of the pulses on water that come back."""
BORDER_M = 0.5
"""Beside the border of the corridor some tall returns were left unclassified."""
