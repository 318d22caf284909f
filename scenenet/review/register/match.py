"""Assets and towers in pairs, by their distance."""

from __future__ import annotations

import numpy as np


def match(assets: np.ndarray, towers: np.ndarray, within: float) -> list[tuple[int, int]]:
    """Pairs of an asset and a tower, each in one pair at most.

    Of all pairings this one has the least sum of distances, where an asset without a tower counts
    as much as one at ``within``. So an asset at its place keeps its tower, even if another one
    nearby has none.

    Args:
        assets: (A, 2) m.
        towers: (T, 2) m.
        within: m, the largest distance in a pair.

    Returns:
        (row of the asset, row of the tower), in the order of the assets.
    """
    from scipy.optimize import linear_sum_assignment
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    if len(assets) == 0 or len(towers) == 0:
        return []
    near = cKDTree(assets).sparse_distance_matrix(cKDTree(towers), within, output_type="ndarray")
    a, t = near["i"], near["j"]
    n = len(assets) + len(towers)
    links = coo_array((np.ones(len(a)), (a, len(assets) + t)), shape=(n, n))
    # What is not linked cannot compete, so the work grows with the crowds and not with the survey.
    _, group = connected_components(links, directed=False)
    order = np.argsort(group[a], kind="stable")
    pairs = []
    for rows in np.split(order, np.flatnonzero(np.diff(group[a][order])) + 1):
        if len(rows) == 0:
            continue
        own_a, at_a = np.unique(a[rows], return_inverse=True)
        own_t, at_t = np.unique(t[rows], return_inverse=True)
        cost = np.full((len(own_a), len(own_t)), within, float)
        allowed = np.zeros(cost.shape, bool)
        cost[at_a, at_t], allowed[at_a, at_t] = near["v"][rows], True
        for i, j in zip(*linear_sum_assignment(cost), strict=True):
            if allowed[i, j]:
                pairs.append((int(own_a[i]), int(own_t[j])))
    return sorted(pairs)
