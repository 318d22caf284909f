"""How far a place is from the edge of the data."""

from __future__ import annotations

import numpy as np

CELL_M = 2.0
"""Size of the cells that are called covered or not."""

LOOK_M = 50.0
"""Nobody asks for more: an edge further away than this has no influence on a tower."""

GAP_CELLS = 2
"""Shadows and water this many cells wide are no edge."""


def edge_distance(place: np.ndarray, ground: np.ndarray) -> float:
    """Planar distance of ``place`` (2,) to where the data end, m, at most ``LOOK_M``.

    Args:
        ground: (M, 2) m, where there are points, at least all within ``LOOK_M`` of the place.
    """
    from scipy.ndimage import binary_closing, distance_transform_edt

    half = int(np.ceil(LOOK_M / CELL_M)) + 1
    cells = np.rint((ground - place) / CELL_M).astype(int) + half  # the place amid its cell
    inside = ((cells >= 0) & (cells < 2 * half)).all(axis=1)
    covered = np.zeros((2 * half, 2 * half), bool)
    covered[tuple(cells[inside].T)] = True
    margin = GAP_CELLS + 1
    padded = binary_closing(np.pad(covered, margin), iterations=GAP_CELLS)
    # What lies beyond the window is out of reach; it must not be taken for an edge.
    closed = padded[margin:-margin, margin:-margin]
    if closed.all():
        return LOOK_M
    # From the middle of a cell to that of the nearest uncovered one, less the half that lies there.
    distance = (distance_transform_edt(closed)[half, half] - 0.5) * CELL_M
    return float(min(max(distance, 0.0), LOOK_M))
