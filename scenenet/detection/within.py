"""Whether a position lies within a planar radius of a place, for compiled loops."""

from __future__ import annotations

import numba
import numpy as np

from scenenet.core.compilation import EXACT

ROUNDING_M = 1e-3
"""More than a distance in metres is rounded by."""


@numba.njit(**EXACT)
def within(dx, dy, radius):  # pragma: no cover - compiled
    """``np.hypot(dx, dy) <= radius``, m, at the cost of a root only where squares, which are
    rounded, do not tell."""
    squared = dx * dx + dy * dy
    if squared > (radius + ROUNDING_M) ** 2:
        return False
    return squared <= max(radius - ROUNDING_M, 0.0) ** 2 or np.hypot(dx, dy) <= radius
