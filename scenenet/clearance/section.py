"""A section of a span: what is near its conductors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from scenenet.clearance.danger import LOW_M
from scenenet.clearance.kinds import NO_OBSTACLE, Surroundings, surroundings
from scenenet.clearance.near_points import Near, near_points
from scenenet.clearance.settings import ClearanceLimits, ClearanceSettings
from scenenet.clearance.touching import AIR, MAY_BE, on_wires, with_touching
from scenenet.clearance.trees import Trees, find_trees
from scenenet.clearance.untraced import untraced
from scenenet.line.frame import SpanFrame
from scenenet.line.records import Conductor
from scenenet.pointcloud.class_schemes import ClassScheme

SECTION_M = 120.0
"""m, longest section, which bounds the points in memory."""

AROUND_M = 20.0
"""m beyond a section whose points show the ground and the crowns in it."""

BEYOND_M = 20.0
"""m beyond the ends of a span whose points count: outside a bend they are abreast of no span."""


@dataclass(frozen=True)
class Area:
    """A part of a span in plan.

    Attributes:
        frame: of the span.
        first, last: m along it; the last is not part of it.
        half_width: m to either side.
    """

    frame: SpanFrame
    first: float
    last: float
    half_width: float

    def box(self) -> np.ndarray:
        """(2, 2) m, lowest and highest x and y."""
        s, w = (self.first, self.last), self.half_width
        corners = np.array([(along, side, 0.0) for along in s for side in (-w, w)])
        xy = self.frame.to_map(corners)[:, :2]
        return np.array([xy.min(axis=0), xy.max(axis=0)])

    def has(self, xyz: np.ndarray) -> np.ndarray:
        """(n,) bool: which points (n, 3) m are in it."""
        s, t = self.frame.in_plan(xyz)
        return (s >= self.first) & (s < self.last) & (np.abs(t) <= self.half_width)


def sections(frame: SpanFrame, conductors: Sequence[Conductor], reach: float) -> list[Area]:
    """The sections of a span, with what is beyond its ends.

    Args:
        conductors: of the span, at least one.
        reach: m beside them.
    """
    ends = np.array(
        [end for wire in conductors for end in (wire.catenary.start, wire.catenary.end)]
    )
    across = np.abs(frame.to_frame(ends)[:, 1]).max()
    n = max(int(np.ceil(frame.length / SECTION_M)), 1)
    borders = np.linspace(0.0, frame.length, n + 1)
    borders[0] -= BEYOND_M
    borders[-1] += BEYOND_M
    half_width = float(across) + reach
    return [Area(frame, first, last, half_width) for first, last in pairwise(borders.tolist())]


@dataclass(frozen=True)
class SectionPoints:
    """Points of a survey in an area, in a fixed order, without those of towers.

    Attributes:
        xyz: (n, 3) m.
        codes: (n,) uint8 class codes; None where they are not known.
        wire: (n,) bool, which points a model takes for wires; None where no model says so.
    """

    xyz: np.ndarray
    codes: np.ndarray | None = None
    wire: np.ndarray | None = None


PointsIn = Callable[[Area], SectionPoints]
"""Gives the points of a survey in an area."""


@dataclass(frozen=True)
class MeasuredSection:
    """What is near the conductors of a section.

    Attributes:
        near: points.
        trees: with their foot in the section.
    """

    near: Near
    trees: Trees


def measure(
    area: Area,
    conductors: Sequence[Conductor],
    flown: Sequence[Conductor],
    points: PointsIn,
    scheme: ClassScheme | None,
    limits: ClearanceLimits | None,
    settings: ClearanceSettings,
    rejected: Sequence[Conductor] = (),
) -> MeasuredSection:
    """What is near the conductors of a span in a section of it.

    Args:
        area: the section.
        conductors: of the span, where it is measured from.
        flown: of this and other spans, that may be near, as flown; their points are not obstacles.
        points: of the survey.
        scheme: of their class codes; None where heights say what they are.
        limits: for the voltage; None without one.
        rejected: conductors that are none, of this and other spans.
    """
    around = look_around(
        area, flown, points, scheme, settings.few_points, rejected, touching=True
    )  # fmt: skip
    here = area.has(around.xyz) & (around.kind != NO_OBSTACLE)
    xyz, kind = np.compress(here, around.xyz, axis=0), around.kind[here]
    last = max(int(np.ceil(area.frame.length / settings.step)) - 1, 0)
    along, _ = area.frame.in_plan(xyz)
    step = np.clip((along / settings.step).astype(int), 0, last)
    trees = find_trees(around, settings.tree_height)
    inside = area.has(trees.feet)
    return MeasuredSection(
        near_points(
            xyz, kind, step, conductors, limits, around.lone[here], around.height[here] < LOW_M
        ),
        Trees(trees.feet[inside], trees.height[inside]),
    )


def look_around(
    area: Area,
    wires: Sequence[Conductor],
    points: PointsIn,
    scheme: ClassScheme | None,
    few_points: int,
    rejected: Sequence[Conductor] = (),
    *,
    touching: bool = False,
) -> Surroundings:
    """What the points in a section and around it are, without those of wires.

    Args:
        wires: whose points are left out.
        points, scheme: as ``measure``.
        few_points: of ``ClearanceSettings``.
        rejected: whose points are obstacles, though a model may take them for wires.
        touching: whether those stay that may be of a wire and hang together with vegetation.
    """
    wide = Area(area.frame, area.first - AROUND_M, area.last + AROUND_M, area.half_width)
    found = points(wide)
    own = on_wires(found.xyz, wires)
    free = own == AIR
    if found.wire is not None:
        doubtful = np.flatnonzero(found.wire & free & (on_wires(found.xyz, rejected) == AIR))
        free[doubtful] = ~untraced(area.frame.to_frame(found.xyz[doubtful]))
    codes = None if found.codes is None else found.codes[free]
    around = surroundings(np.compress(free, found.xyz, axis=0), codes, scheme, few_points)
    if not touching:
        return around
    close = own == MAY_BE
    codes = None if found.codes is None else found.codes[close]
    return with_touching(around, found.xyz[close], codes, scheme)
