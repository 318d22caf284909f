"""Places where points are too near a conductor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

CELL_M = 1.0
"""m, edge of the cells in plan that are joined to places."""

JOINED_M = 2.9
"""m, distance of the centres of cells that belong to one place: at most one empty cell, or two in a
diagonal, lies between them."""


def places(xyz: np.ndarray, kind: np.ndarray) -> Iterator[np.ndarray]:
    """Rows (m,) of the points of each place; a place has points of one kind.

    Args:
        xyz: (n, 3) m, of the points.
        kind: (n,) integers.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    for number in np.unique(kind):
        rows = np.flatnonzero(kind == number)
        cells, cell = np.unique(np.floor(xyz[rows, :2] / CELL_M), axis=0, return_inverse=True)
        pairs = cKDTree(cells * CELL_M).query_pairs(JOINED_M, output_type="ndarray")
        links = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(cells),) * 2)
        n, place = connected_components(links, directed=False)
        place = place[cell.ravel()]
        for each in range(n):
            yield rows[place == each]
