"""Places where points are too near a conductor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

CELL_M = 1.0
"""m, edge of the cells in plan that are joined to places."""

JOINED_M = 2.9
"""m, distance of the centres of cells that belong to one place: at most one empty cell, or two in a
diagonal, lies between them."""

REACH_M = 5.0
"""m in plan that a part of a place of vegetation reaches around its nearest point: that of a crown.
Trees beside a line touch one another for hundreds of metres, and each of them may have to be cut.
"""

LOW_M = 1.0
"""m above the ground up to which growth is low. It fills the gaps between crowns, and may be nearer
to a conductor than they are: a crown beside it would be listed only where the low growth is."""


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


def layers(low: np.ndarray, few: int) -> list[np.ndarray]:
    """Rows (m,) of the points of a place in each layer of it: of low growth, and of what stands
    above it. Fewer than ``few`` points make no layer; they belong to the other one.

    Args:
        low: (n,) bool, which points are of low growth.
    """
    if min(low.sum(), (~low).sum()) < few:
        return [np.arange(len(low))]
    return [np.flatnonzero(~low), np.flatnonzero(low)]


def divided(xyz: np.ndarray, distance: np.ndarray, few: int) -> list[np.ndarray]:
    """Rows (m,) of the parts of a place, each around its nearest point, the nearest part first.

    A part reaches ``REACH_M`` in plan around its nearest point. Fewer than ``few`` points beyond
    the parts make no part; they belong to the one next to them.

    Args:
        xyz: (n, 3) m, of the points.
        distance: (n,) m, from the conductors.
    """
    from scipy.spatial import cKDTree

    part = np.full(len(xyz), -1)
    left = np.argsort(distance, kind="stable")
    centres: list[int] = []
    while len(left):
        near = np.hypot(*(xyz[left, :2] - xyz[left[0], :2]).T) <= REACH_M
        if not centres or near.sum() >= few:
            part[left[near]] = len(centres)
            centres.append(int(left[0]))
        left = left[~near]
    beyond = np.flatnonzero(part < 0)
    part[beyond] = cKDTree(xyz[centres, :2]).query(xyz[beyond, :2])[1]
    return [np.flatnonzero(part == each) for each in range(len(centres))]
