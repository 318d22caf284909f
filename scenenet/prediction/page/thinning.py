"""Fewer points that look the same."""

from __future__ import annotations

from collections.abc import Sequence

import numba
import numpy as np

from scenenet.core.compilation import EXACT
from scenenet.core.extent import extent

STEP_M = 0.01
"""m, step of the coordinates in a picture. A pixel is wider."""

FINER = 1.2
"""Ratio of successive cell sizes when points are thinned."""


def thinned(xyz: np.ndarray, most: int) -> np.ndarray:
    """At most ``most`` of the points (n, 3) m, one for each cell of a size that gives so many.

    Thin parts such as conductors keep their points, because a cell counts once, however many points
    are in it. Equal points in equal order give the same result.
    """
    if len(xyz) <= most:
        return xyz
    low, high = extent(xyz)
    # Not the lowest point of each cell: trees would look like shelves.
    # A permutation of the rows themselves gives the same in twice the time.
    xyz = np.take(xyz, np.random.default_rng(0).permutation(len(xyz)), axis=0)
    offsets = xyz - low
    # Points lie on surfaces: about as many cells as points of the result cover the widest one.
    cell = max(STEP_M, float(np.sqrt(np.prod(np.sort(high - low)[1:]) / most)) / 4)
    kept = _one_each(offsets, cell, len(offsets))
    while len(kept) > most:
        # The size is found with the points that are left: they are few.
        few = offsets[kept]
        while len(few) > most:
            cell *= FINER
            few = few[_one_each(few, cell, len(few))]
        kept = _one_each(offsets, cell, 4 * most)
    return xyz[kept]


@numba.njit(**EXACT)
def _one_each(offsets, cell, expected):  # pragma: no cover - compiled
    """Rows of the first of the points (n, 3) m in each cell, ascending; no offset is negative.

    ``expected`` cells are quickly found: their table is in the cache where they are few. There may
    be more.
    """
    rows, n = np.empty(len(offsets), np.int64), 0
    places = 1
    while places < 2 * min(expected, len(offsets)):
        places *= 2
    seen = np.full(places, -1, np.int64)
    for i in range(len(offsets)):
        x, y, z = offsets[i]
        code = np.int64(np.floor(x / cell)) << 42
        code |= np.int64(np.floor(y / cell)) << 21 | np.int64(np.floor(z / cell))
        mixed = (code ^ (code >> 32)) * np.int64(0x9E3779B97F4A7C1)
        mixed = (mixed ^ (mixed >> 32)) * np.int64(0x9E3779B97F4A7C1)
        at = (mixed ^ (mixed >> 29)) & (places - 1)
        while seen[at] >= 0 and seen[at] != code:
            at = (at + 1) & (places - 1)
        if seen[at] < 0:
            if 2 * n > places:
                return _one_each(offsets, cell, len(offsets))
            seen[at] = code
            rows[n] = i
            n += 1
    return rows[:n]


def quotas(counts: Sequence[int], weights: Sequence[float], most: int) -> list[int]:
    """How many of each of several groups of points are kept, ``most`` in all.

    Args:
        counts: number of points in each group.
        weights: share of each group where all have more; what one does not need, the others get.
    """
    kept = [0] * len(counts)
    left, open_groups = most, [n for n in range(len(counts)) if counts[n]]
    while open_groups and left > 0:
        total = sum(weights[n] for n in open_groups)
        small = [n for n in open_groups if counts[n] <= left * weights[n] / total]
        if not small:
            for n in open_groups:
                kept[n] = int(left * weights[n] / total)
            break
        for n in small:
            kept[n] = counts[n]
            left -= counts[n]
        open_groups = [n for n in open_groups if n not in small]
    return kept
