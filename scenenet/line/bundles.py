"""Tell the subconductors of a bundle apart."""

from __future__ import annotations

import numpy as np

BUNDLE_CELL_M = 0.06
"""m, cells in which the points of a wire are counted when it is seen along itself: twice the spread
of a scanner, and a fifth of the distance of subconductors."""

BUNDLE_FLOOR, BUNDLE_SHARE, BUNDLE_POINTS = 0.12, 0.12, 10
"""Points in a cell of a subconductor, as a share of those in the fullest cell; points of a
subconductor as a share of all of the wire, and their number."""

MOST_SUBCONDUCTORS = 8


def subconductors(seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tell the subconductors of a bundle apart.

    Args:
        seen: (n, 2) m, points to the left of the wire and above it.

    Returns:
        (n,) number of the subconductor of each point, -1 for none, and their places (k, 2) m.
    """
    from scipy.ndimage import label as labelled

    steps = np.floor(seen / BUNDLE_CELL_M).astype(int)
    steps -= steps.min(axis=0) - 1
    counts = np.zeros(steps.max(axis=0) + 2, int)
    np.add.at(counts, tuple(steps.T), 1)
    areas, n = labelled(counts > BUNDLE_FLOOR * counts.max(), np.ones((3, 3)))
    of = areas[tuple(steps.T)] - 1
    sizes = np.bincount(of[of >= 0], minlength=n)
    kept = np.flatnonzero(sizes >= max(BUNDLE_SHARE * len(seen), BUNDLE_POINTS))
    if len(kept) < 2 or len(kept) > MOST_SUBCONDUCTORS:
        return np.zeros(len(seen), int), seen.mean(axis=0)[None]
    number = np.full(n, -1)
    number[kept] = np.arange(len(kept))
    of = np.where(of >= 0, number[of], -1)
    return of, np.array([seen[of == k].mean(axis=0) for k in range(len(kept))])
