"""The structure of a tower: which points are its own.

A tower is measured in the points around the axis that the voxels gave. The result is a shape and
not a list of points: a tapered body, crossarms in a plane across the line, and the ground below.
Any point of the survey can be asked whether it lies in the shape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenenet.detection.conductor_rules import (
    BESIDE,
    BESIDE_M,
    OPPOSITE,
    OVER_M,
    POLE_M,
    UNDER_TOP,
    WINDOW_M,
)
from scenenet.detection.conductors import Span
from scenenet.detection.ground import Ground, fit_ground
from scenenet.detection.head import ARM_M, NO_HEAD, Head, find_head
from scenenet.detection.portal import find_twin
from scenenet.detection.profile import GAP_M, SCRUB_M, SHIFT_M, Profile, fit_profile, furthest

MARGIN_M = 0.1
"""m around members: noise of ranging and of the axis."""

FOOT_M = 0.5
"""m above the ground below which grass and scrub cannot be told from the foot of a tower."""

SCRUB_TOP_M, SCRUB_TOP = 3.0, 0.15
"""Height of the highest scrub around a foot: m, and as a share of the height of the body. Below a
tall tower it may grow higher, because there is more clearance."""

BELOW_ARM = 0.08
"""Share of the height below the lowest conductor at which struts of a crossarm may start."""

PEAK_M = 1.5
"""m above the highest conductor that the top of a tower may be."""

SPARSE = 0.8
"""Share of the height in voxels up to which conductors are looked for at least."""

POINTS_PER_M = 0.7
"""Smallest number of points of a body per m of its height. Fewer show no body; the corner of a
facade may have them."""

UPRIGHT_M = 1.5
"""m, smallest height of the levels in which a body has to be unbroken."""

TOP_GAP = 3.0
"""m without a point that end a body upwards, so that a bird above it is not its top."""

AMID_SHIFT_M = 1.0
"""m, largest distance of the axis of a window tower from the middle of its conductors. Further away
is one of its legs."""


Leaving = Callable[[np.ndarray, float, float, float], Sequence[Span]]
"""The conductors that leave a tower, from its axis (2,), the elevation of its foot, its height, and
the largest distance at which a conductor passes the axis, m."""


@dataclass(frozen=True)
class Structure:
    """The shape of a tower.

    Attributes:
        x, y: m, axis.
        ground: the ground around the axis.
        height: m, from the ground to the top.
        foot: m above the ground from which points are the tower's own; scrub is below.
        along: (2,) unit vector along the line.
        profile: the body around the axis; its s and t are 0.
        head: the crossarms.
        apart: m, half the distance between the two bodies of a portal, which stand to the left and
            right of the axis; 0 for one body.
        upright: share of the levels of the body that have a point.
        spans: directions in which conductors leave.
    """

    x: float
    y: float
    ground: Ground
    height: float
    foot: float
    along: np.ndarray
    profile: Profile
    upright: float
    head: Head
    spans: tuple[Span, ...]
    apart: float = 0.0

    @property
    def reach(self) -> float:
        """m, largest planar distance of a point of the tower from the axis."""
        wide = self.profile.foot + self.apart + MARGIN_M
        return float(np.hypot(max(self.head.reach, wide), wide + ARM_M))

    def moved(self, x: float, y: float, z: float) -> Structure:
        """The same shape elsewhere, m."""
        ground = replace(self.ground, elevation=self.ground.elevation + z)
        return replace(self, x=self.x + x, y=self.y + y, ground=ground)

    def carries(self, length: float) -> bool:
        """Whether it carries conductors of this ``length``, the sum of ``Span.followed``.

        The lowest is not above its top, the highest is near it, and they pass the axis on both
        sides, or close to it on one.
        """
        if length == 0:
            return True
        if sum(span.followed for span in self.spans) < length:
            return False
        if min(span.lowest for span in self.spans) > self.height + OVER_M:
            return False
        if max(span.highest for span in self.spans) < UNDER_TOP * self.height:
            return False
        sides = _sides(self.spans, _across(self.along))
        limit = BESIDE_M if 2 * self.profile.top <= POLE_M else BESIDE * self.height
        return max(min(sides), -max(sides)) <= limit

    def contains(self, xyz: np.ndarray) -> np.ndarray:
        """(N,) bool, which points (N, 3) m are the tower's own."""
        s, t, h = self.frame(xyz)
        return self.in_body(s, t, h) | self.in_arm(s, t, h)

    def frame(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points (N, 3) m as s along the line, t to its right, h above the ground, (N,) m each."""
        return _frame(xyz, np.array([self.x, self.y]), self.along, self.ground)

    def in_body(self, s: np.ndarray, t: np.ndarray, h: np.ndarray) -> np.ndarray:
        """(N,) bool, which points in its frame are of the body."""
        half = self.profile.half_width(h) + MARGIN_M
        inside = np.maximum(np.abs(s), np.abs(np.abs(t) - self.apart)) <= half
        return inside & (h >= self.foot) & (h <= self.height + MARGIN_M)

    def in_arm(self, s: np.ndarray, t: np.ndarray, h: np.ndarray) -> np.ndarray:
        """(N,) bool, which points in its frame are of the crossarms."""
        return (np.abs(s) <= self.head.thick) & self.head.covers(t, h)


@dataclass(frozen=True)
class BodyTests:
    """What a body has to be to belong to a tower.

    Attributes:
        height: m, smallest height.
        upright: smallest share of the levels with a point.
        free: smallest share of the levels at which it stands free.
    """

    height: float
    upright: float
    free: float

    def passed(self, body: Structure) -> bool:
        return (
            body.height >= self.height
            and body.upright >= self.upright
            and body.profile.free >= self.free
        )


def measure_structure(
    points: np.ndarray,
    leaving: Leaving,
    axis: np.ndarray,
    base: float,
    height: float,
    crossarm: float,
    tests: BodyTests,
    amid: bool,
) -> Structure | None:
    """The structure at an approximate axis, or None where no body stands free.

    Args:
        points: (N, 3) m, within ``candidates.SURROUNDINGS_M`` of the axis in plan.
        leaving: gives the conductors; only asked for where it matters.
        axis: (2,) m, approximate.
        base, height: m, elevation of the foot and height above it, approximate.
        crossarm: m, largest distance at which a conductor passes the axis.
        tests: what a body has to be; conductors are only looked for where it is.
        amid: whether the axis is looked for amid the conductors and not where it is thought to be.
    """
    first = None if amid else _measure_body(points, axis, _along(()), height)
    if first is None and not amid:
        return None
    if first is not None:
        if not tests.passed(first):
            return None
        axis, base = np.array([first.x, first.y]), first.ground.elevation
    # Few returns may leave a gap below the head, which the conductors then show.
    top = height if first is None else max(first.height, SPARSE * height)
    spans = tuple(leaving(axis, base, top, crossarm))
    # Now the direction of the line is known.
    if amid:
        if not spans:
            return None
        # From there, conductors show on both sides.
        axis = axis + _middle(spans)
        spans = tuple(leaving(axis, base, top, crossarm))
        sides = _sides(spans, _across(_along(spans)))
        if not spans or max(sides) - min(sides) < WINDOW_M:
            return None
    start = axis + _middle(spans) if amid else axis
    tall, shift = (height, AMID_SHIFT_M) if first is None else (first.height + 1, SHIFT_M)
    body = _measure_body(points, start, _along(spans), tall, shift)
    if body is None or not tests.passed(body):
        return None
    return _with_head(_with_twin(body, points), points, spans, axis)


def _measure_body(
    points: np.ndarray, axis: np.ndarray, along: np.ndarray, height: float, shift: float = SHIFT_M
) -> Structure | None:
    """The body near an axis, without crossarms and conductors."""
    points = _around(points, axis, np.sqrt(2) * furthest(height))
    if len(points) == 0:
        return None
    s, t, h = _frame(points, axis, along, fit_ground(points, axis))
    profile = fit_profile(s, t, h, height, shift)
    if profile is None:
        return None
    axis = axis + profile.s * along + profile.t * _across(along)
    profile = replace(profile, s=0.0, t=0.0)
    ground = fit_ground(points, axis)
    s, t, h = _frame(points, axis, along, ground, FOOT_M)
    half = profile.half_width(h) + MARGIN_M
    inside = np.maximum(np.abs(s), np.abs(t)) <= half
    foot = _foot(s, t, h, profile, height)
    of_body = h[inside & (h >= foot)]
    top, upright = _top(of_body, height, profile.level, foot)
    if top is None or (of_body <= top).sum() < POINTS_PER_M * (top - foot):
        return None
    x, y = axis.tolist()
    return Structure(x, y, ground, top, foot, along, profile, upright, NO_HEAD, ())


def _with_twin(body: Structure, points: np.ndarray) -> Structure:
    """The body, or both bodies of a portal."""
    axis = np.array([body.x, body.y])
    s, t, h = _frame(points, axis, body.along, body.ground, SCRUB_M)
    at = find_twin(s, t, h, body.profile, body.height)
    if at is None:
        return body
    away = at / 2 * _across(body.along)
    x, y = (axis + away).tolist()
    ground = fit_ground(points, np.array([x, y]))
    top = body.height + body.ground.elevation + float(body.ground.slope @ away)
    return replace(body, x=x, y=y, ground=ground, apart=abs(at) / 2, height=top - ground.elevation)


def _with_head(
    body: Structure, points: np.ndarray, spans: tuple[Span, ...], origin: np.ndarray
) -> Structure:
    """The body with its crossarms, which the conductors show.

    Args:
        origin: (2,) m, the axis that the spans are relative to.
    """
    across = _across(body.along)
    moved = float((origin - np.array([body.x, body.y])) @ across)
    body = replace(body, spans=spans)
    line = tuple(
        span
        for span in body.spans
        if abs(_unit(span.bearing) @ body.along) > np.cos(np.radians(45.0))
    )
    if not line:
        return body
    sides = [side + moved for side in _sides(line, across)]
    lowest = min(span.lowest for span in line) - BELOW_ARM * body.height
    lowest = max(lowest, body.height / 2)
    highest = max(body.height, *(span.highest for span in line))
    reach = max(abs(side) for side in sides)
    s, t, h = _frame(points, np.array([body.x, body.y]), body.along, body.ground, lowest)
    head = find_head(s, t, h, body.profile, body.apart, lowest, highest, reach)
    shape = replace(body, head=head, height=highest + PEAK_M)
    top = max(body.height, float(h[shape.in_arm(s, t, h)].max(initial=0.0)))
    return replace(shape, height=top)


def _foot(s: np.ndarray, t: np.ndarray, h: np.ndarray, profile: Profile, height: float) -> float:
    """m above the ground up to which vegetation is as dense around the body as in it."""
    half = profile.half_width(h) + MARGIN_M
    distance = np.maximum(np.abs(s), np.abs(t))
    levels = np.arange(FOOT_M, max(SCRUB_TOP_M, SCRUB_TOP * height), FOOT_M)
    foot = FOOT_M
    for level in levels:
        at = (h >= level) & (h < level + FOOT_M)
        inside = (at & (distance <= half)).sum()
        around = (at & (distance > half) & (distance <= half + GAP_M)).sum()
        width = float(profile.half_width(np.array([level]))[0]) + MARGIN_M
        areas = width**2 / ((width + GAP_M) ** 2 - width**2)
        if 2 * around * areas > inside:
            foot = float(level + FOOT_M)
    return foot


def _around(points: np.ndarray, axis: np.ndarray, radius: float) -> np.ndarray:
    """The points (N, 3) m in a square of twice ``radius`` m about an axis (2,) m, (M, 3)."""
    near = np.abs(points[:, 0] - axis[0]) <= radius
    near &= np.abs(points[:, 1] - axis[1]) <= radius
    return points.T[:, np.flatnonzero(near)].T


def _frame(
    xyz: np.ndarray,
    axis: np.ndarray,
    along: np.ndarray,
    ground: Ground,
    lowest: float | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """s along the line, t to its right, h above the ground, each (N,) m; of the points that are at
    least ``lowest`` m above it, if that is given."""
    east, north = xyz[:, 0] - axis[0], xyz[:, 1] - axis[1]
    h = ground.height(east, north, xyz[:, 2])
    if lowest is not None:
        rows = np.flatnonzero(h >= lowest)
        east, north, h = east[rows], north[rows], h[rows]
    return east * along[0] + north * along[1], east * along[1] - north * along[0], h


def _along(spans: tuple[Span, ...]) -> np.ndarray:
    """Unit vector (2,) along the line, across the crossarms: north if there is no conductor."""
    if not spans:
        return np.array([0.0, 1.0])
    first = _unit(spans[0].bearing)
    for other in spans[1:]:
        second = _unit(other.bearing)
        if first @ second < np.cos(np.radians(OPPOSITE)):
            both = first - second
            return both / np.linalg.norm(both)
    return first


def _across(along: np.ndarray) -> np.ndarray:
    """Unit vector (2,) to the right of the line."""
    return np.array([along[1], -along[0]])


def _unit(bearing: float) -> np.ndarray:
    return np.array([np.sin(np.radians(bearing)), np.cos(np.radians(bearing))])


def _sides(spans: tuple[Span, ...], across: np.ndarray) -> list[float]:
    """m, where the outermost conductors of each span pass the tower, to the right of the line."""
    sides = []
    for span in spans:
        u = _unit(span.bearing)
        right = np.array([u[1], -u[0]])
        sides += [span.left * float(right @ across), span.right * float(right @ across)]
    return sides


def _middle(spans: tuple[Span, ...]) -> np.ndarray:
    """(2,) m, from the axis to the middle of the conductors."""
    along = _along(spans)
    across = _across(along)
    sides = _sides(spans, across)
    return (min(sides) + max(sides)) / 2 * across if sides else np.zeros(2)


def _top(h: np.ndarray, height: float, level: float, foot: float) -> tuple[float | None, float]:
    """Height of the top in m, and the share of the levels between ``foot`` and it with a point.

    Args:
        h: (N,) m above the ground, points of the body from ``foot`` upwards.
        height: m, approximate.
        level: m, height of the levels in which a gap is looked for.
    """
    if len(h) == 0:
        return None, 0.0
    levels = np.unique(np.floor(h / level).astype(int))
    start = levels[np.argmin(np.abs(levels - height / (2 * level)))]
    above = levels[levels >= start]
    breaks = np.flatnonzero(np.diff(above) > max(TOP_GAP / level, 1))
    last = above[breaks[0]] if len(breaks) else above[-1]
    top = float(h[np.floor(h / level).astype(int) <= last].max())
    tall = max(level, UPRIGHT_M)
    below = h[h <= top]
    n_levels = max(int(np.ceil((top - foot) / tall)), 1)
    seen = np.unique(np.minimum(((below - foot) / tall).astype(int), n_levels - 1))
    return top, len(seen) / n_levels
