"""The frame of a tower: along the line, across it, and above the ground."""

from __future__ import annotations

import numpy as np

from scenenet.detection.conductor_rules import OPPOSITE
from scenenet.detection.conductors import Span
from scenenet.detection.ground import Ground


def line_frame(
    xyz: np.ndarray,
    axis: np.ndarray,
    along: np.ndarray,
    ground: Ground,
    lowest: float | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points as s along the line, t to its right, h above the ground, each (N,) m.

    Args:
        xyz: (N, 3) m.
        axis: (2,) m.
        along: (2,) unit vector.
        lowest: m above the ground; lower points are left out. None for all points.
    """
    east, north = xyz[:, 0] - axis[0], xyz[:, 1] - axis[1]
    h = ground.height(east, north, xyz[:, 2])
    if lowest is not None:
        rows = np.flatnonzero(h >= lowest)
        east, north, h = east[rows], north[rows], h[rows]
    return east * along[0] + north * along[1], east * along[1] - north * along[0], h


def rise(s: np.ndarray, t: np.ndarray, along: np.ndarray, ground: Ground) -> np.ndarray:
    """(N,) m from the ground at the axis up to the ground at positions along the line and to its
    right, (N,) m each."""
    return np.asarray(s * (ground.slope @ along) + t * (ground.slope @ across(along)))


SHARPEST = 75.0
"""degrees; the only two spans of a tower that are further apart than this are the two sides of one
line, which turns there."""


def direction_of(spans: tuple[Span, ...]) -> np.ndarray:
    """Unit vector (2,) along the line, across the crossarms, which halve the angle at which the
    line turns: north if there is no conductor."""
    if not spans:
        return np.array([0.0, 1.0])
    first = unit(spans[0].bearing)
    apart = SHARPEST if len(spans) == 2 else OPPOSITE
    for other in spans[1:]:
        second = unit(other.bearing)
        if first @ second < np.cos(np.radians(apart)):
            both = first - second
            return both / np.linalg.norm(both)
    return first


def across(along: np.ndarray) -> np.ndarray:
    """Unit vector (2,) to the right of the line."""
    return np.array([along[1], -along[0]])


def unit(bearing: float) -> np.ndarray:
    """Unit vector (2,) at a bearing in degrees, clockwise from north."""
    return np.array([np.sin(np.radians(bearing)), np.cos(np.radians(bearing))])


def sides_of(spans: tuple[Span, ...], along: np.ndarray) -> list[float]:
    """m, where the outermost conductors of each span pass the axis, to the right of a line with
    direction ``along`` (2,)."""
    right, sides = across(along), []
    for span in spans:
        turned = float(across(unit(span.bearing)) @ right)
        sides += [span.left * turned, span.right * turned]
    return sides


def middle_of(spans: tuple[Span, ...]) -> np.ndarray:
    """(2,) m, from the axis to the middle of the conductors."""
    along = direction_of(spans)
    sides = sides_of(spans, along)
    return (min(sides) + max(sides)) / 2 * across(along) if sides else np.zeros(2)
