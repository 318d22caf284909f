"""Find the clearances of a survey: span by span, a section at a time."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenenet.clearance import danger
from scenenet.clearance.crossings import Crossing, crossings
from scenenet.clearance.distance import nearest_on
from scenenet.clearance.kinds import kinds_from
from scenenet.clearance.near_points import POINT_KINDS, NearPoint, TooNear
from scenenet.clearance.records import (
    Clearance,
    FallTree,
    ProfileStep,
    SpanClearance,
    SurveyClearances,
)
from scenenet.clearance.sags import with_sags, without_conductor
from scenenet.clearance.section import BEYOND_M, Area, PointsIn, measure, sections
from scenenet.clearance.settings import KINDS, VEGETATION, WIRE, ClearanceLimits, ClearanceSettings
from scenenet.clearance.trees import Trees
from scenenet.core.progress import track
from scenenet.line.frame import SpanFrame
from scenenet.line.records import AS_FLOWN, Conductor, LineSpan, SurveyLine
from scenenet.pointcloud.class_schemes import ClassScheme

MOST_NAMED = 10
"""Most spans that a warning names."""
SAME_TREE_M = 1.0
"""m, planar: two trees of neighbouring spans that are nearer are one."""


def find_clearances(
    line: SurveyLine,
    points: PointsIn,
    settings: ClearanceSettings,
    scheme: ClassScheme | None = None,
    progress: str | None = None,
) -> SurveyClearances:
    """What is near the conductors of a survey. Memory is that of a section.

    Args:
        line: its lines.
        points: gives its points.
        scheme: of their class codes; None where the height above ground says what they are.
        progress: label of the progress on stderr; None shows no progress.

    Raises:
        InputError: the table of limits has none for the voltage.
    """
    if unknown := without_conductor(line, settings.sags):
        listed = ", ".join(map(str, unknown[:MOST_NAMED])) + ", ..." * (len(unknown) > MOST_NAMED)
        print(
            f"warning: spans in the table of sags of which no conductor was found here: {listed}",
            file=sys.stderr,
        )
    finder = _Finder(line, points, settings, scheme, settings.applied())
    spans = [span for span in line.spans if span.line]
    walked = spans if progress is None else track(spans, progress)
    found = [finder.span(span) for span in walked]
    places = [place for each in found for place in each.places]
    places += finder.crossing_places()
    places.sort(key=lambda place: (place.order, place.span_id, place.conductor_id))
    trees = _once([tree for each in found for tree in each.trees])
    rows = [finder.row(span, places, trees) for span in spans]
    rows.sort(key=_worst)
    profile = tuple(step for each in found for step in each.profile)
    return SurveyClearances(
        tuple(places), tuple(trees), tuple(rows), profile, finder.kinds, finder.limits_named
    )


@dataclass(frozen=True)
class _FoundSpan:
    """What is near the conductors of a span."""

    places: list[Clearance]
    trees: list[FallTree]
    profile: list[ProfileStep]


class _Finder:
    """Measures the spans of a survey with the same settings."""

    def __init__(
        self,
        line: SurveyLine,
        points: PointsIn,
        settings: ClearanceSettings,
        scheme: ClassScheme | None,
        limits: ClearanceLimits | None,
    ) -> None:
        self._flown, self._line = line, with_sags(line, settings.sags)
        self._points, self._settings = points, settings
        self._scheme, self._limits = scheme, limits
        self.kinds = kinds_from(scheme)
        self.limits_named = "" if limits is None else f"{settings.voltage:g} kV: {limits.source}"
        wires = [wire.catenary for wire in line.conductors]
        self._low = np.array([np.minimum(w.start, w.end)[:2] for w in wires]).reshape(-1, 2)
        self._high = np.array([np.maximum(w.start, w.end)[:2] for w in wires]).reshape(-1, 2)

    def span(self, span: LineSpan) -> _FoundSpan:
        """What is near the conductors of a span."""
        own = [wire for wire in self._line.conductors if wire.span_id == span.span_id]
        frame = SpanFrame.between(np.array(span.start), np.array(span.end))
        measured = [
            measure(
                area, own, self._flown_near(area), self._points, self._scheme, self._limits,
                self._settings, self._flown.rejected,
            )
            for area in sections(frame, own, self._settings.reach)
        ]  # fmt: skip
        nearest: dict[tuple[int, str], NearPoint] = {}
        steps: dict[tuple[int, str], NearPoint] = {}
        for section in measured:
            for point in section.near.nearest:
                _keep(nearest, (point.conductor.conductor_id, point.kind), point)
            for number, point in section.near.steps:
                _keep(steps, (number, point.kind), point)
        places = [self._place("nearest", point, 0) for point in nearest.values()]
        places += self._dangers(TooNear.together([each.near.too_near for each in measured]), own)
        trees = [tree for section in measured for tree in self._falling(section.trees, own)]
        profile = [self._step(frame, span, *key, steps[key]) for key in sorted(steps)]
        return _FoundSpan(places, trees, profile)

    def crossing_places(self) -> list[Clearance]:
        """The nearest wire of each other line, for each conductor."""
        return [self._crossing(each) for each in crossings(self._line, self._settings.reach)]

    def row(
        self, span: LineSpan, places: Sequence[Clearance], trees: Sequence[FallTree]
    ) -> SpanClearance:
        """The worst of a span, of places that are sorted by their order."""
        own = [place for place in places if place.span_id == span.span_id]
        dangers = [place for place in own if place.what == "danger"]
        falling = [tree for tree in trees if tree.span_id == span.span_id]
        by_kind = {
            kind: min((place.distance for place in own if place.kind == kind), default=None)
            for kind in KINDS
        }
        return SpanClearance(
            span_id=span.span_id, line=span.line, order=span.order, from_tower=span.from_tower,
            to_tower=span.to_tower, worst_kind=own[0].kind if own else "",
            worst_margin=own[0].margin if own else None, **by_kind,
            dangers=len(dangers), few_points=sum(bool(place.note) for place in dangers),
            danger_points=sum(place.points for place in dangers), fall_trees=len(falling),
            fall_margin=min((tree.margin for tree in falling), default=None),
            kinds=self.kinds, limits=self.limits_named, positions=self._positions(span),
        )  # fmt: skip

    def _positions(self, span: LineSpan) -> str:
        """What the positions of the wires of a span are: what was modelled comes first."""
        said = {w.positions for w in self._line.conductors if w.span_id == span.span_id}
        return min(said - {AS_FLOWN}, default=AS_FLOWN)

    def _flown_near(self, area: Area) -> list[Conductor]:
        """Wires as flown that may be in an area."""
        low, high = area.box()
        low, high = low - BEYOND_M, high + BEYOND_M
        near = ((self._low <= high) & (self._high >= low)).all(axis=1)
        return [self._flown.conductors[row] for row in np.flatnonzero(near).tolist()]

    def _dangers(self, too_near: TooNear, own: Sequence[Conductor]) -> list[Clearance]:
        wires = {wire.conductor_id: wire for wire in own}
        found = []
        for rows in self._parts(too_near):
            worst = rows[np.argmin(too_near.distance[rows])]
            point = NearPoint(
                wires[int(too_near.conductor[worst])], POINT_KINDS[too_near.kind[worst]],
                too_near.xyz[worst], float(too_near.along[worst]), float(too_near.distance[worst]),
            )  # fmt: skip
            found.append(self._place("danger", point, len(rows)))
        return found

    def _parts(self, too_near: TooNear) -> Iterator[np.ndarray]:
        """Rows (m,) of the points of each place; one of vegetation may be several."""
        for rows in danger.places(too_near.xyz, too_near.kind):
            if POINT_KINDS[too_near.kind[rows[0]]] != VEGETATION:
                yield rows
                continue
            few = self._settings.few_points
            for layer in danger.layers(too_near.low[rows], few):
                own = rows[layer]
                for part in danger.divided(too_near.xyz[own], too_near.distance[own], few):
                    yield own[part]

    def _place(self, what: str, point: NearPoint, points: int, other_span: int = 0) -> Clearance:
        wire = point.conductor
        on = wire.catenary.at(np.array([point.along]))[0]
        x, y, z = point.xyz.tolist()
        limit = None if self._limits is None else self._limits.of(point.kind)
        few = what == "danger" and point.kind != WIRE and points < self._settings.few_points
        return Clearance(
            span_id=wire.span_id, conductor_id=wire.conductor_id, conductor_kind=wire.kind,
            what=what, kind=point.kind, distance=point.distance, vertical=float(on[2]) - z,
            horizontal=float(np.hypot(on[0] - x, on[1] - y)), limit=limit,
            margin=None if limit is None else point.distance - limit, points=points,
            note="few points" if few else "", along=point.along, x=x, y=y, z=z,
            wire_x=float(on[0]), wire_y=float(on[1]), wire_z=float(on[2]), other_span=other_span,
            kinds=self.kinds, positions=wire.positions,
        )  # fmt: skip

    def _crossing(self, each: Crossing) -> Clearance:
        xyz = each.other.catenary.at(np.array([each.other_along]))[0]
        point = NearPoint(each.conductor, WIRE, xyz, each.along, each.distance)
        place = self._place("nearest", point, 0, each.other.span_id)
        too_near = place.margin is not None and place.margin < 0
        return replace(place, what="danger") if too_near else place

    def _falling(self, trees: Trees, own: Sequence[Conductor]) -> list[FallTree]:
        """The trees of a section that could fall on a wire of its span."""
        if not len(trees.height):
            return []
        near = [nearest_on(wire.catenary, trees.feet) for wire in own]
        distance = np.array([each.distance for each in near])
        wire = distance.argmin(axis=0)
        margin = distance.min(axis=0) - trees.height
        return [
            FallTree(
                x=float(trees.feet[row, 0]), y=float(trees.feet[row, 1]),
                ground=float(trees.feet[row, 2]), height=float(trees.height[row]),
                distance=float(distance[wire[row], row]), margin=float(margin[row]),
                span_id=own[wire[row]].span_id, conductor_id=own[wire[row]].conductor_id,
                along=float(near[wire[row]].along[row]), kinds=self.kinds,
                positions=own[wire[row]].positions,
            )
            for row in np.flatnonzero(margin < self._settings.fall_reserve).tolist()
        ]  # fmt: skip

    def _step(
        self, frame: SpanFrame, span: LineSpan, number: int, kind: str, point: NearPoint
    ) -> ProfileStep:
        along = float(frame.to_frame(point.xyz[None])[0, 0])
        x, y, z = point.xyz.tolist()
        on = point.conductor.catenary.at(np.array([point.along]))[0]
        return ProfileStep(
            span_id=span.span_id, start=number * self._settings.step, kind=kind,
            distance=point.distance, conductor_id=point.conductor.conductor_id, along=along,
            x=x, y=y, z=z, wire_z=float(on[2]), positions=point.conductor.positions,
        )  # fmt: skip


def _keep(
    nearest: dict[tuple[int, str], NearPoint], key: tuple[int, str], point: NearPoint
) -> None:
    """Keep the nearer one of the points of a key."""
    if key not in nearest or point.distance < nearest[key].distance:
        nearest[key] = point


def _once(trees: list[FallTree]) -> list[FallTree]:
    """The trees, worst first; one that neighbouring spans or sections have stays with the worse."""
    from scipy.spatial import cKDTree

    trees = sorted(trees, key=lambda tree: (tree.margin, tree.x, tree.y))
    if not trees:
        return trees
    index = cKDTree([(tree.x, tree.y) for tree in trees])
    dropped: set[int] = set()
    for first, second in index.query_pairs(SAME_TREE_M):
        dropped.add(max(first, second))
    return [tree for row, tree in enumerate(trees) if row not in dropped]


def _worst(row: SpanClearance) -> tuple[float, int]:
    """By which spans are sorted, the worst first."""
    known = [each for each in (row.ground, row.vegetation, row.building, row.wire) if each]
    value = row.worst_margin if row.worst_margin is not None else min(known, default=np.inf)
    return float(value), row.span_id
