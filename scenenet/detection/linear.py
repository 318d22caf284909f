"""Which voxels are part of something long, thin and nearly level."""

from __future__ import annotations

import numba
import numpy as np

from scenenet.core.compilation import COMPILED
from scenenet.detection.conductor_rules import MIN_VOXELS, RISE, SCALES, THIN


def long_and_thin(
    places: np.ndarray, candidate: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The candidates that are part of something long, thin and level.

    Args:
        places: (M, 3) m.
        candidate: (M,) bool.

    Returns:
        positions (N, 3) m, horizontal unit vectors (N, 2) along the conductors, and their rise
        (N,) per metre in that direction.
    """
    from scipy.spatial import cKDTree

    pairs = cKDTree(places).query_pairs(max(SCALES), output_type="ndarray")
    counts, sums, products = _moments(places, candidate, pairs, np.square(SCALES))
    thinnest = np.full(len(places), np.inf)
    heading = np.zeros((len(places), 3))
    for radius, count, total, product in zip(SCALES, counts, sums, products, strict=True):
        rows = np.flatnonzero(candidate & (count >= MIN_VOXELS))
        n = count[rows, None]
        mean = total[rows] / n
        spread = product[rows] / n[:, None] - mean[:, :, None] * mean[:, None]
        variance, direction = np.linalg.eigh(spread)
        along = direction[:, :, 2]
        # A line of length l has the variance l^2 / 12; it must cover half the sphere's diameter.
        long = variance[:, 2] * 12 >= radius**2
        level = np.abs(along[:, 2]) <= RISE
        share = variance[:, 1] / np.maximum(variance[:, 2], 1e-9)
        better = long & level & (share <= THIN) & (share < thinnest[rows])
        thinnest[rows[better]] = share[better]
        heading[rows[better]] = along[better]
    thin = np.isfinite(thinnest)
    level_part = np.linalg.norm(heading[thin, :2], axis=1)
    return places[thin], heading[thin, :2] / level_part[:, None], heading[thin, 2] / level_part


@numba.njit(**COMPILED)
def _moments(places, candidate, pairs, squared_radii):  # pragma: no cover - compiled
    """Number of the voxels in the neighbourhoods of each candidate, itself included (R, M), sum of
    their offsets from it (R, M, 3), and of the products of these (R, M, 3, 3), for R radii that
    ascend. Rows of other voxels have sums of no meaning."""
    n, n_radii = len(places), len(squared_radii)
    count = np.ones((n_radii, n))
    total = np.zeros((n_radii, n, 3))
    product = np.zeros((n_radii, n, 3, 3))
    offset = np.empty(3)
    for p in range(len(pairs)):
        i, j = pairs[p, 0], pairs[p, 1]
        if not (candidate[i] or candidate[j]):
            continue
        square = 0.0
        for a in range(3):
            offset[a] = places[j, a] - places[i, a]
            square += offset[a] * offset[a]
        for r in range(n_radii - 1, -1, -1):
            if square > squared_radii[r]:
                break
            count[r, i] += 1
            count[r, j] += 1
            for a in range(3):
                total[r, i, a] += offset[a]
                total[r, j, a] -= offset[a]
                for b in range(3):
                    product[r, i, a, b] += offset[a] * offset[b]
                    product[r, j, a, b] += offset[a] * offset[b]
    return count, total, product
