"""Follows conductors away from a tower, to the next support or to the edge of the data.

A conductor hangs between two supports. The jib of a crane, a branch or the edge of a roof ends in
the air.
"""

from __future__ import annotations

import numpy as np

from scenenet.detection.conductor_rules import (
    ABOVE_GROUND_M,
    FAR,
    FURTHEST_M,
    MISSED_M,
    RISE,
    SIDE_M,
    STEP_M,
    SUPPORT,
    SUPPORT_M,
)
from scenenet.detection.conductors import Span


def leads_on(span: Span, axis: np.ndarray, base: float, occupied: np.ndarray, size: float) -> bool:
    """Whether the conductors of a span lead to a support, to the edge of the data or far away.

    Args:
        span: the conductors near the tower.
        axis: (2,) m, of the tower.
        base: m, elevation of its foot.
        occupied: (M, 3) m, centres of the occupied voxels within ``FURTHEST_M + FAR`` of the axis.
        size: m, of the voxels.
    """
    heading = np.array([np.sin(np.radians(span.bearing)), np.cos(np.radians(span.bearing))])
    offset = occupied - np.array([*axis, base])
    s = offset[:, :2] @ heading
    t = offset[:, 0] * heading[1] - offset[:, 1] * heading[0]
    z = offset[:, 2]
    known = span.places - np.array([*axis, base])
    along = known[:, :2] @ heading
    side = known[:, 0] * heading[1] - known[:, 1] * heading[0]
    last = along >= along.max() - 2 * STEP_M
    end, left, right = float(along.max()), float(side[last].min()), float(side[last].max())
    low, high = float(known[last, 2].min()), float(known[last, 2].max())
    ground = _ground(s, t, z)
    ahead = (s > end - STEP_M) & (t >= left - FAR) & (t <= right + FAR)
    s, t, z = s[ahead], t[ahead], z[ahead]
    place = end
    # Steep ones would leave the corridor, which moves by half of what it sees.
    climb = span.slope * STEP_M if abs(span.slope) > RISE else 0.0
    while place - end < MISSED_M and end < FURTHEST_M:
        low, high = low + climb, high + climb
        piece = (s > place) & (s <= place + STEP_M)
        grow = SIDE_M * (1 + (place - end) / MISSED_M)
        here = (
            piece
            & (t >= left - grow)
            & (t <= right + grow)
            & (z >= low - grow)
            & (z <= high + grow)
        )
        here &= z > ground + ABOVE_GROUND_M
        place += STEP_M
        if here.any():
            end = place
            left, right = _towards(left, right, t[here])
            low, high = _towards(low, high, z[here])
    if end >= FURTHEST_M:
        return True
    near = (np.abs(s - end) <= SUPPORT_M) & (t >= left - SUPPORT_M) & (t <= right + SUPPORT_M)
    beyond = (s > end + STEP_M) & (s <= end + STEP_M + MISSED_M)
    beyond &= (t >= left - SUPPORT_M) & (t <= right + SUPPORT_M)
    if not beyond.any():
        return True
    levels = np.unique(np.floor((z[near] - ground) / size))
    below = max(low - ground, size)
    return bool((levels * size < below).sum() >= SUPPORT * below / size)


def _ground(s: np.ndarray, t: np.ndarray, z: np.ndarray) -> float:
    """m, low level of the voxels along the conductor."""
    beside = (s > 0) & (np.abs(t) <= FAR / 2)
    return float(np.percentile(z[beside], 5)) if beside.any() else float(z.min())


def _towards(low: float, high: float, values: np.ndarray) -> tuple[float, float]:
    """The range moved to where the values are; it may shrink and grow by half."""
    return (low + float(values.min())) / 2, (high + float(values.max())) / 2
