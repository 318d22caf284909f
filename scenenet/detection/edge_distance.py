"""Distance of a position from the edge of the data."""

from __future__ import annotations

import numpy as np

CELL_M = 2.0
"""Size of the cells that are covered by points or not."""

MAX_M = 50.0
"""Largest distance: an edge further away has no influence on a tower."""

GAP_CELLS = 2
"""Uncovered shadows and water up to this many cells wide are not an edge."""


def edge_distance(place: np.ndarray, ground: np.ndarray) -> float:
    """Planar distance in m of ``place`` (2,) from the edge of the data, at most ``MAX_M``.

    Args:
        ground: (M, 2) m, positions of points or voxels, at least all within ``MAX_M``.
    """
    from scipy.ndimage import binary_closing, distance_transform_edt

    half = int(np.ceil(MAX_M / CELL_M)) + 1
    cells = np.rint((ground - place) / CELL_M).astype(int) + half  # ``place`` is a cell centre
    inside = ((cells >= 0) & (cells < 2 * half)).all(axis=1)
    covered = np.zeros((2 * half, 2 * half), bool)
    covered[tuple(cells[inside].T)] = True
    margin = GAP_CELLS + 1
    padded = binary_closing(np.pad(covered, margin), iterations=GAP_CELLS)
    # Cells outside the window are unknown and must not count as an edge.
    closed = padded[margin:-margin, margin:-margin]
    if closed.all():
        return MAX_M
    # From the centre of the cell to the border of the nearest uncovered one.
    distance = (distance_transform_edt(closed)[half, half] - 0.5) * CELL_M
    return float(min(max(distance, 0.0), MAX_M))
