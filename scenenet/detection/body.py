"""What stands on an axis: its foot, its height, whether it goes all the way, and its middle.

Measured in the occupied voxels. Places are (M, 3) m, middles of voxels of one lattice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SLIM = 1 / 8
"""Half the width of a body as a part of its height, at most; twice that for its legs."""

SLIM_M = 2.0
"""m; but the body of a low tower is looked for this far from the axis, which is known to a voxel or
two."""

TOP_GAP = 3.0
"""m of nothing that end a tower upwards: a bird above it is not its top."""

STRAY_GAP = 10.0
"""m between detected voxels that end it too: a stray return high above can look like a pole."""

MIDDLE = 0.3, 0.9
"""Parts of the height between which a body stands free: below are shrubs and its legs."""

LOOKS = 2.0, 1.5, 1.0
"""Radii, as multiples of the slim one, at which the middle is looked for one after the other: a
model that saw a leg or a crossarm put the axis beside it."""


@dataclass(frozen=True)
class Body:
    """What stands on an axis.

    Attributes:
        base: m, elevation of the ground at its foot.
        height: m, from there to its top.
        upright: share of the levels in between at which something stands.
    """

    base: float
    height: float
    upright: float


def standing(
    around: np.ndarray,
    axis: np.ndarray,
    seen: np.ndarray,
    foot_radius: float,
    voxel_size: float,
) -> Body:
    """Measure what stands on an axis (2,) m.

    Args:
        around: (M, 3) m, occupied voxels.
        seen: (N,) m, elevations of its detected voxels, at least one.
        foot_radius: m, where the ground is looked for.
    """
    distance = np.hypot(around[:, 0] - axis[0], around[:, 1] - axis[1])
    elevations = np.append(around[distance <= foot_radius, 2], seen.min())
    # Not the lowest: a return from below the ground must not make a tower of a bush.
    lowest = float(np.percentile(elevations, 5))
    detected = np.unique(np.rint((seen - seen.min()) / voxel_size).astype(int))
    midst = int((np.median(seen) - seen.min()) / voxel_size)
    head = _unbroken(detected, midst, STRAY_GAP / voxel_size)
    height = seen.min() + head * voxel_size - lowest
    slim = max(SLIM_M, SLIM * height)
    legs = around[:, 2] - lowest < MIDDLE[0] * height
    near = distance <= np.where(legs, 2 * slim, slim)
    # Levels are counted from the lowest one that is surely on the lattice.
    levels = np.unique(np.rint((around[near, 2] - seen.min()) / voxel_size).astype(int))
    foot = round((lowest - seen.min()) / voxel_size)
    top = _unbroken(np.union1d(levels, detected[detected <= head]), midst, TOP_GAP / voxel_size)
    upright = ((levels >= foot) & (levels <= top)).sum() / (top - foot + 1)
    base = lowest - voxel_size / 2
    return Body(base, float(seen.min() + (top + 0.5) * voxel_size - base), float(upright))


def _unbroken(levels: np.ndarray, start: int, gap: float) -> int:
    """The last of ascending levels (N,) that is reached from ``start`` without a wider ``gap``."""
    above = np.append(start, levels[levels > start])
    breaks = np.flatnonzero(np.diff(above) > gap)
    return int(above[breaks[0]] if len(breaks) else above[-1])


def middle(
    around: np.ndarray, axis: np.ndarray, body: Body, voxel_size: float
) -> tuple[np.ndarray, float, float]:
    """Axis (2,) m in the middle of a body, its width in m, and the share of it that stands free.

    Level by level, what hangs together there and comes near the axis is the body, as long as it is
    slim. Where it is not, a wire, a tree or a building touches it. Where that is so at all levels,
    nothing stands free: the axis stays where it is and the width is NaN.
    """
    from scipy.ndimage import label

    slim = max(SLIM_M, SLIM * body.height)
    relative = around - np.array([*axis, body.base])
    low, high = (part * body.height for part in MIDDLE)
    between = (relative[:, 2] >= low) & (relative[:, 2] <= high)
    places = relative[between & (np.hypot(relative[:, 0], relative[:, 1]) <= 4 * slim)]
    at, width, free = np.zeros(2), float("nan"), 0.0
    if len(places) == 0:
        return axis, width, free
    steps = np.rint((places - places.min(axis=0)) / voxel_size).astype(int)
    volume = np.zeros(steps.max(axis=0) + 1, bool)
    volume[tuple(steps.T)] = True
    within_level = np.zeros((3, 3, 3))
    within_level[:, :, 1] = 1
    piece = label(volume, within_level)[0][tuple(steps.T)]
    for look in LOOKS:
        near = np.hypot(places[:, 0] - at[0], places[:, 1] - at[1]) <= look * slim
        mine = np.isin(piece, np.unique(piece[near]))
        middles, widths = [], []
        for level in np.unique(steps[mine, 2]):
            found = places[mine & (steps[:, 2] == level), :2]
            size = np.ptp(found, axis=0) + voxel_size
            if size.max() <= 2 * slim + voxel_size:
                middles.append((found.min(axis=0) + found.max(axis=0)) / 2)
                widths.append(size.max())
        if middles:
            at, width = np.median(middles, axis=0), float(np.median(widths))
            free = len(middles) / len(np.unique(steps[mine, 2]))
    return axis + at, width, free
