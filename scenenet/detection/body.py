"""Measures the body on an axis: foot, height, continuity and centre.

All positions are centres of occupied voxels on one lattice, (M, 3) m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SLIM = 1 / 8
"""Largest half width of a body as a share of its height; legs may be twice as wide."""

SLIM_M = 2.0
"""m, smallest search radius for a body, because the axis is only known to a voxel or two."""

TOP_GAP = 3.0
"""m, a gap that ends a tower upwards, so that a bird above it is not its top."""

STRAY_GAP = 10.0
"""m, a gap between detected voxels that ends it too, because a stray return high above can look
like a pole."""

MIDDLE = 0.3, 0.9
"""Shares of the height between which the body is measured: below are shrubs and its legs."""

SEARCH_RADII = 2.0, 1.5, 1.0
"""Successive search radii for the centre, in multiples of the slim radius. The axis may start on a
leg or a crossarm."""


@dataclass(frozen=True)
class Body:
    """The body on an axis.

    Attributes:
        base: m, elevation of the ground at its foot.
        height: m, from the base to its top.
        upright: share of the levels from foot to top with an occupied voxel.
    """

    base: float
    height: float
    upright: float


def measure_body(
    around: np.ndarray,
    axis: np.ndarray,
    elevations: np.ndarray,
    foot_radius: float,
    voxel_size: float,
) -> Body:
    """The body on an axis (2,) m.

    Args:
        around: (M, 3) m, occupied voxels.
        elevations: (N,) m, of its detected voxels, at least one.
        foot_radius: m, radius in which the ground is measured.
        voxel_size: m.
    """
    distance = np.hypot(around[:, 0] - axis[0], around[:, 1] - axis[1])
    lowest_seen = elevations.min()
    near_foot = np.append(around[distance <= foot_radius, 2], lowest_seen)
    # A percentile, because a single return below the ground would make a bush as tall as a tower.
    lowest = float(np.percentile(near_foot, 5))
    detected = np.unique(np.rint((elevations - lowest_seen) / voxel_size).astype(int))
    middle = int((np.median(elevations) - lowest_seen) / voxel_size)
    head = _unbroken(detected, middle, STRAY_GAP / voxel_size)
    height = lowest_seen + head * voxel_size - lowest
    slim = max(SLIM_M, SLIM * height)
    legs = around[:, 2] - lowest < MIDDLE[0] * height
    near = distance <= np.where(legs, 2 * slim, slim)
    # Levels count from the lowest detected voxel, which is on the lattice.
    levels = np.unique(np.rint((around[near, 2] - lowest_seen) / voxel_size).astype(int))
    foot = round((lowest - lowest_seen) / voxel_size)
    top = _unbroken(np.union1d(levels, detected[detected <= head]), middle, TOP_GAP / voxel_size)
    upright = ((levels >= foot) & (levels <= top)).sum() / (top - foot + 1)
    base = lowest - voxel_size / 2
    return Body(base, float(lowest_seen + (top + 0.5) * voxel_size - base), float(upright))


def _unbroken(levels: np.ndarray, start: int, gap: float) -> int:
    """The highest of ascending levels (N,) above ``start`` before a gap wider than ``gap``."""
    above = np.append(start, levels[levels > start])
    breaks = np.flatnonzero(np.diff(above) > gap)
    return int(above[breaks[0]] if len(breaks) else above[-1])


def centre_body(
    around: np.ndarray, axis: np.ndarray, body: Body, voxel_size: float
) -> tuple[np.ndarray, float]:
    """Axis (2,) m through the centre of a body, and the share that stands free.

    At each level the body consists of the connected voxels near the axis. A level stands free if
    they are slim; otherwise a conductor, a tree or a building touches the body. If no level stands
    free, the axis does not change.
    """
    from scipy.ndimage import label

    slim = max(SLIM_M, SLIM * body.height)
    relative = around - np.array([*axis, body.base])
    low, high = (part * body.height for part in MIDDLE)
    between = (relative[:, 2] >= low) & (relative[:, 2] <= high)
    places = relative[between & (np.hypot(relative[:, 0], relative[:, 1]) <= 4 * slim)]
    at, free = np.zeros(2), 0.0
    if len(places) == 0:
        return axis, free
    steps = np.rint((places - places.min(axis=0)) / voxel_size).astype(int)
    volume = np.zeros(steps.max(axis=0) + 1, bool)
    volume[tuple(steps.T)] = True
    within_level = np.zeros((3, 3, 3))
    within_level[:, :, 1] = 1
    piece = label(volume, within_level)[0][tuple(steps.T)]
    # Level by level, so that all levels are measured at once.
    order = np.argsort(steps[:, 2], kind="stable")
    places, level, piece = places[order], steps[order, 2], piece[order]
    for multiple in SEARCH_RADII:
        near = np.hypot(places[:, 0] - at[0], places[:, 1] - at[1]) <= multiple * slim
        if not near.any():
            continue
        reached = np.zeros(piece.max() + 1, bool)
        reached[piece[near]] = True
        in_body = reached[piece]
        _, first = np.unique(level[in_body], return_index=True)
        least = np.minimum.reduceat(places[in_body, :2], first)
        greatest = np.maximum.reduceat(places[in_body, :2], first)
        stands_free = (greatest - least + voxel_size).max(axis=1) <= 2 * slim + voxel_size
        if stands_free.any():
            at = np.median((least + greatest)[stands_free] / 2, axis=0)
            free = float(stands_free.mean())
    return axis + at, free
