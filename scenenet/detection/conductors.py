"""Conductors that leave a tower, which distinguish it from other tall objects.

A conductor is long, thin and nearly level, hangs in free air and leads away from the head of the
tower that carries it. Points show all of this without labels: a roof is as wide as it is long, a
treetop has no straight line in it, and no conductor leaves a street light.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from scenenet.detection.candidates import SURROUNDINGS_M
from scenenet.detection.conductor_blocks import ConductorBlocks
from scenenet.detection.conductor_rules import (
    ALONE_M,
    ATTACHED,
    CONTINUES_M,
    FAR,
    GAP,
    HEAD,
    LEVEL_M,
    MAX_LEVELS,
    MIN_ALONE,
    MIN_ANGLE,
    MIN_LENGTH,
    NEAR,
    RISE,
    SECTOR,
)
from scenenet.detection.surroundings import Surroundings

PASS_M = 0.5
"""m, squares across a span in which a conductor counts once."""


def _no_passes() -> np.ndarray:
    return np.empty((0, 2))


@dataclass(frozen=True)
class Span:
    """Conductors that leave in one direction.

    Attributes:
        bearing: degrees from north (+y), clockwise.
        length: m, longest stretch between ``NEAR`` and ``FAR`` without a gap.
        followed: that length as a share of the distance from ``NEAR`` to ``FAR``, or to the edge of
            the data in this direction.
        slope: rise of the conductors per metre away from the tower.
        left, right: m, least and greatest distance to the right of the axis at which they pass it,
            as seen along the bearing.
        lowest, highest: m, heights of the lowest and the highest one above the foot, at the tower.
        places: (M, 3) m, points on the conductors.
        passes: (K, 2) m, where conductors pass the axis: to its right, as seen along the bearing,
            and height above the foot; one for each square of ``PASS_M``.
    """

    bearing: float
    length: float
    followed: float
    slope: float
    left: float
    right: float
    lowest: float
    highest: float
    places: np.ndarray = field(repr=False, compare=False)
    passes: np.ndarray = field(repr=False, compare=False, default_factory=_no_passes)

    def without_places(self) -> Span:
        """The same span without the points on its conductors."""
        return replace(self, places=np.empty((0, 3)))

    def without_passes(self) -> Span:
        """The same span without the places where its conductors pass, one by one."""
        return replace(self, passes=_no_passes())

    def passes_of(self, offset: np.ndarray) -> Span:
        """The same span, with ``passes`` at a place (3,) m from the foot on the axis."""
        east, north = np.sin(np.radians(self.bearing)), np.cos(np.radians(self.bearing))
        right = offset[0] * north - offset[1] * east
        return replace(self, passes=self.passes - np.array([right, offset[2]]))


class ConductorPoints:
    """The points of a survey that lie on conductors, looked for where they are needed."""

    def __init__(self, points: Surroundings, lowest: float) -> None:
        """Nothing is looked for yet.

        Args:
            points: gives the points around a position. Threads may call it side by side.
            lowest: m above the ground; lower points are not on conductors.
        """
        self._blocks = ConductorBlocks(points, lowest)

    def expect(self, axis: np.ndarray, crossarm: float) -> None:
        """Begin to look, in another thread, for what ``leaving`` needs at an axis (2,) m."""
        self._blocks.expect(axis, _reach(crossarm))

    def leaving(
        self, axis: np.ndarray, base: float, height: float, crossarm: float, around: Surroundings
    ) -> list[Span]:
        """Directions in which conductors leave a tower, the longest first.

        Args:
            axis: (2,) m.
            base, height: m, elevation of its foot and height above it.
            crossarm: m, largest distance at which a conductor passes the axis.
            around: gives what is around the tower, which shows where the data end. Most places
                have no conductor, and it is not looked up there.
        """
        foot = np.array([*axis, base])
        places, directions, others, rise = self._blocks.near(axis, _reach(crossarm))
        offset = places - foot
        distance = np.hypot(offset[:, 0], offset[:, 1])
        # Down a steep slope, conductors pass below the head of the tower that they leave.
        lowest = HEAD * height - (rise - RISE) * distance
        here = (distance >= NEAR) & (offset[:, 2] >= lowest)
        here &= offset[:, 2] <= height + rise * distance
        if not here.any():
            return []
        level = np.hypot(directions[here, 0], directions[here, 1])
        heading, slope = directions[here, :2] / level[:, None], directions[here, 2] / level
        near = around(axis, SURROUNDINGS_M) - foot
        spans = _spans(offset[here], heading, slope, near, crossarm)
        spans = [replace(span, places=span.places + foot) for span in spans]
        return [
            span
            for span in spans
            if _alone(span, others) >= MIN_ALONE and _levels(span) <= MAX_LEVELS
        ]


def _reach(crossarm: float) -> float:
    """m, distance from an axis up to which conductors are looked for."""
    return float(np.hypot(FAR, crossarm))


def _alone(span: Span, others: np.ndarray) -> float:
    """Share of the points around a span that lie on conductors. A roof or a facade with few points
    shows lines too, amid others; conductors hang alone, or close to a tree at some places.

    Args:
        others: (N, 3) m, tested points that are not on lines.
    """
    from scipy.spatial import cKDTree

    near = others >= span.places.min(axis=0) - ALONE_M
    near &= others <= span.places.max(axis=0) + ALONE_M
    others = others[near.all(axis=1)]
    if len(others) == 0:
        return 1.0
    beside = cKDTree(span.places).query(others, distance_upper_bound=ALONE_M)[0] <= ALONE_M
    return len(span.places) / (len(span.places) + int(beside.sum()))


def _levels(span: Span) -> int:
    """Largest number of conductors above one another, at least ``LEVEL_M`` m apart."""
    heading = np.array([np.sin(np.radians(span.bearing)), np.cos(np.radians(span.bearing))])
    ahead = span.places[:, :2] @ heading
    across = np.round(span.places[:, 0] * heading[1] - span.places[:, 1] * heading[0])
    height = span.places[:, 2] - span.slope * ahead
    planes = [np.sort(height[across == plane]) for plane in np.unique(across)]
    return max(1 + int((np.diff(plane) >= LEVEL_M).sum()) for plane in planes)


def _spans(
    place: np.ndarray, heading: np.ndarray, slope: np.ndarray, near: np.ndarray, crossarm: float
) -> list[Span]:
    """The spans of places (M, 3) m on conductors, relative to the foot.

    Args:
        heading: (M, 2) unit vectors along the conductors.
        slope: (M,) their rise per metre in that direction.
        near: (N, 3) m, all that is around; it shows where the data end.
        crossarm: m, largest distance at which a conductor passes the axis.
    """
    # s is the distance along the conductor, t the distance at which it passes the axis. The heading
    # points away from the tower.
    s = np.einsum("ni,ni->n", place[:, :2], heading)
    away = np.where(s < 0, -1.0, 1.0)
    heading, slope, s = heading * away[:, None], slope * away, np.abs(s)
    t = np.abs(place[:, 0] * heading[:, 1] - place[:, 1] * heading[:, 0])
    leaves = (s >= NEAR) & (s <= FAR) & (t <= crossarm)
    place, slope, s = place[leaves], slope[leaves], s[leaves]
    distance, towards = np.hypot(near[:, 0], near[:, 1]), _bearing(near)
    spans = []
    for bearing, length, members in _runs(_bearing(heading[leaves]), s):
        end = distance[_angle(towards, bearing) <= SECTOR].max(initial=NEAR)
        available = max(min(float(end), FAR) - NEAR, MIN_LENGTH)
        rise = float(np.median(slope[members]))
        attached, passes = _attachments(place[members], s[members], bearing, rise)
        followed = min(1.0, length / available)
        spans.append(Span(bearing, length, followed, rise, *attached, place[members], passes))
    return spans


def _attachments(
    place: np.ndarray, s: np.ndarray, bearing: float, slope: float
) -> tuple[tuple[float, float, float, float], np.ndarray]:
    """Where the conductors of a span pass the tower: least and greatest distance to the right of
    the axis, and least and greatest height, m; and all of them (K, 2), as in ``Span.passes``.

    Places that continue one another towards the tower are a conductor; treetops are not.

    Args:
        place: (M, 3) m, places of the span, relative to the foot.
        s: (M,) m, their distances along it.
    """
    right = np.array([np.cos(np.radians(bearing)), -np.sin(np.radians(bearing))])
    near = s <= max(ATTACHED, float(s.min()) + MIN_LENGTH)
    passes = np.column_stack([place[near, :2] @ right, place[near, 2] - slope * s[near]])
    metre = np.floor(s[near]).astype(int)
    same = (np.abs(passes[:, None] - passes[None]) <= 1.0).all(axis=2)
    continues = np.array([len(np.unique(metre[row])) for row in same])
    conductor = passes[continues >= min(CONTINUES_M, continues.max())]
    (left, lowest), (right, highest) = conductor.min(axis=0), conductor.max(axis=0)
    squares = np.unique(np.round(conductor / PASS_M), axis=0) * PASS_M
    return (float(left), float(right), float(lowest), float(highest)), squares


def _runs(bearing: np.ndarray, s: np.ndarray) -> Iterator[tuple[float, float, np.ndarray]]:
    """Bearing in degrees, length in m and members (M,) bool of each span, the longest first.

    Args:
        bearing: (M,) degrees, of points on conductors.
        s: (M,) m, their distances along the conductors.
    """
    middles = np.arange(0.0, 360.0, SECTOR / 3)
    inside = _angle(bearing, middles[:, None]) <= SECTOR
    metre = s.astype(np.int64)
    left = np.ones(len(bearing), bool)
    while left.any():
        sectors, points = np.nonzero(inside & left)
        seen = np.zeros((len(middles), metre.max() + 1), bool)
        seen[sectors, metre[points]] = True
        count = np.bincount(sectors, minlength=len(middles))
        lengths = _longest_runs(seen)
        longest = int(np.lexsort((-middles, count, lengths))[-1])
        length = float(lengths[longest])
        if length < MIN_LENGTH:
            return
        angle = _angle(bearing, float(middles[longest]))
        members = left & (angle <= SECTOR)
        radians = np.radians(bearing[members])
        mean = np.degrees(np.arctan2(np.sin(radians).mean(), np.cos(radians).mean())) % 360
        yield float(mean), length, members
        left &= angle > MIN_ANGLE


def _bearing(vectors: np.ndarray) -> np.ndarray:
    """(M,) degrees from +y, clockwise, of vectors (M, 2 or more)."""
    return np.degrees(np.arctan2(vectors[:, 0], vectors[:, 1])) % 360


def _angle(bearing: np.ndarray, middle: float | np.ndarray) -> np.ndarray:
    """Degrees in [0, 180] between bearings and ``middle``."""
    return np.abs((bearing - middle + 180) % 360 - 180)


def _longest_runs(seen: np.ndarray) -> np.ndarray:
    """(R,) m, longest stretch of the metres (R, M) bool that are seen, without a gap over ``GAP``
    m."""
    metre = np.arange(seen.shape[1])
    before = np.maximum.accumulate(np.where(seen, metre, -np.inf), axis=1)
    before = np.column_stack([np.full(len(seen), -np.inf), before[:, :-1]])
    starts = np.where(seen & (metre - before > GAP), metre, -1)
    length = metre - np.maximum.accumulate(starts, axis=1) + 1
    return np.asarray(np.where(seen, length, 0).max(axis=1, initial=0))
