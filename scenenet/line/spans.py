"""The spans of a line: wires between two towers, or from a tower into the air."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from scenenet.core.progress import track
from scenenet.detection.conductor_rules import BESIDE, BESIDE_M, POLE_M, SHORTEST_SPAN_M
from scenenet.line.edge_spans import Seen, edge_spans
from scenenet.line.frame import SpanFrame
from scenenet.line.graph import STRAY
from scenenet.line.lone_wires import lone_spans
from scenenet.line.trace import GAP_M
from scenenet.line.traced_spans import REACH_M, LineTower, SpanWire, TracedSpan, traced
from scenenet.line.wire_points import WirePoints

LONGEST_M = 1200.0
"""m, longest span that is looked for. Spans over valleys and rivers are the longest ones."""

SHORTEST_M = 4.0
"""m; towers closer to one another are poles of one support."""

FOLLOWED = 0.4
"""Share of the way between two towers with a wire point, from which a span is looked for there."""

BETWEEN_M = 6.0
"""m, distance from the axis of a span up to which a tower divides it."""

BEHIND = 8.0
"""Degrees from the direction of a span in which no longer span leaves the same tower: what is there
is behind the next one."""

MUCH_LOWER = 0.75
"""Share of the height of a tower below which one next to it is doubtful: two supports of a line
that are so close to each other are about equally tall."""

LONGEST_JIB_M = 80.0
"""m, longest jib of a crane."""

UNSEEN_M, UNSEEN_SHARE = 40.0, 0.35
"""m, and share of a span, that may be hidden between the first point of a wire and its tower; the
greater of both. Between its points, as much as at both ends together."""


def find_spans(
    points: WirePoints, towers: Sequence[LineTower], seen: Seen, progress: str | None = None
) -> list[TracedSpan]:
    """All spans, those between two towers first.

    A crane beside the line, or a mast under it, may be nearer than the next tower. So a tower that
    stands beside all of the wires, or next to a much taller one, takes those that no other does.

    Where no wire is certain between two towers of a line, doubtful points count if they show that
    the line goes on there.

    Args:
        seen: gives what the survey has around a place; it shows where the survey ends.
        progress: label of the progress on stderr; None shows no progress.
    """
    free = np.ones(len(points), bool)
    found: list[TracedSpan] = []
    doubtful: list[tuple[LineTower, LineTower]] = []
    without: list[tuple[LineTower, LineTower]] = []
    low = _next_to_taller(towers)
    pairs = list(_pairs(points, towers))
    for first, last in pairs if progress is None else track(pairs, progress):
        span = _span(points, free, found, first, last)
        if span is None:
            without.append((first, last))
        elif any(t.id in low or _beside(t, span.wires) for t in (first, last)):
            doubtful.append((first, last))
        else:
            _add(span, found, free)
    for first, last in doubtful:
        span = _span(points, free, found, first, last)
        if span is not None:
            _add(span, found, free)
    for first, last in without:
        span = _span(points, free, found, first, last, doubtful=True)
        if span is not None and _goes_on(found, span):
            _add(span, found, free)
    for span in edge_spans(points, free, towers, found, seen):
        _add(span, found, free)
    return _without_jibs(found + lone_spans(points, free, towers))


def _without_jibs(spans: Sequence[TracedSpan]) -> list[TracedSpan]:
    """The spans without those that may be the jib of a crane: it leaves its mast in one direction
    only, and no wire leads from there to a tower."""
    linked = {t.id for s in spans if s.start and s.end for t in (s.start, s.end)}

    def is_jib(span: TracedSpan) -> bool:
        tower = span.start or span.end
        if tower is None or tower.id in linked:
            return False
        return len(tower.bearings) == 1 and span.frame.length <= LONGEST_JIB_M

    return [span for span in spans if not is_jib(span)]


def _add(span: TracedSpan, found: list[TracedSpan], free: np.ndarray) -> None:
    """Add a span; its points are no longer ``free`` (N,)."""
    found.append(span)
    for wire in span.wires:
        free[wire.rows] = False


def _span(
    points: WirePoints,
    free: np.ndarray,
    found: Sequence[TracedSpan],
    first: LineTower,
    last: LineTower,
    *,
    doubtful: bool = False,
) -> TracedSpan | None:
    """The span between two towers, among points that are ``free`` (N,); None if there is none."""
    frame = SpanFrame.between(first.place, last.place)
    if _leads_elsewhere(found, first, frame.direction) or _leads_elsewhere(
        found, last, -frame.direction
    ):
        return None
    rows = points.beside(frame, REACH_M)
    rise = (last.base - first.base) / frame.length
    gap = max(GAP_M, 2 * UNSEEN_SHARE * frame.length)
    wires = traced(points, rows[free[rows]], frame, rise, gap, doubtful=doubtful)
    wires = tuple(_between(wires, frame, first, last))
    return TracedSpan(first, last, frame, wires) if wires else None


def _goes_on(found: Sequence[TracedSpan], span: TracedSpan) -> bool:
    """Whether both towers of a span hold about as many wires in another one, so that a line goes on
    with it."""
    for tower in (span.start, span.end):
        held = [len(each.wires) for each in found if tower is each.start or tower is each.end]
        if not held or len(span.wires) < STRAY * max(held):
            return False
    return True


def _next_to_taller(towers: Sequence[LineTower]) -> set[int]:
    """Ids of the towers that are nearer to a much taller one than any span is long."""
    from scipy.spatial import cKDTree

    places = np.array([tower.place for tower in towers]).reshape(-1, 2)
    near = cKDTree(places).query_pairs(SHORTEST_SPAN_M, output_type="ndarray")
    pairs = (sorted((towers[i], towers[j]), key=lambda t: t.height) for i, j in near)
    return {low.id for low, high in pairs if low.height < MUCH_LOWER * high.height}


def _beside(tower: LineTower, wires: Sequence[SpanWire]) -> bool:
    """Whether all of these parallel wires pass a tower on one side, and none is close to it."""
    sides = [float(wire.catenary.along(tower.place[None])[1][0]) for wire in wires]
    pole = tower.width is not None and tower.width <= POLE_M
    limit = BESIDE_M if pole else BESIDE * tower.height
    return max(min(sides), -max(sides)) > limit


def _leads_elsewhere(found: Sequence[TracedSpan], tower: LineTower, way: np.ndarray) -> bool:
    """Whether a span, and so a shorter one, leaves a tower in a direction (2,) already."""
    for span in found:
        for end, sign in ((span.start, 1.0), (span.end, -1.0)):
            if end is tower and sign * span.frame.direction @ way >= np.cos(np.radians(BEHIND)):
                return True
    return False


def _pairs(
    points: WirePoints, towers: Sequence[LineTower]
) -> Iterator[tuple[LineTower, LineTower]]:
    """Pairs of towers with wire points on the way and no tower between, the nearest first."""
    from scipy.spatial import cKDTree

    if len(towers) < 2:
        return
    places = np.array([tower.place for tower in towers])
    pairs = cKDTree(places).query_pairs(LONGEST_M, output_type="ndarray")
    apart = np.hypot(*(places[pairs[:, 0]] - places[pairs[:, 1]]).T)
    for pair in pairs[np.lexsort((pairs[:, 1], pairs[:, 0], np.round(apart, 3)))]:
        first, last = sorted((towers[i] for i in pair), key=lambda tower: (tower.x, tower.y))
        frame = SpanFrame.between(first.place, last.place)
        if frame.length <= SHORTEST_M:
            continue
        s, t, _ = frame.to_frame(np.column_stack((places, np.zeros(len(places))))).T
        between = (np.abs(t) <= BETWEEN_M) & (s > BETWEEN_M) & (s < frame.length - BETWEEN_M)
        if not between.any() and points.followed(frame, REACH_M / 2) >= FOLLOWED:
            yield first, last


def _between(
    wires: Sequence[SpanWire], frame: SpanFrame, first: LineTower, last: LineTower
) -> Iterator[SpanWire]:
    """The wires that two towers hold, from the one to the other."""
    hidden = max(UNSEEN_M, UNSEEN_SHARE * frame.length)
    for wire in wires:
        catenary = wire.catenary
        (start, beside), (end, beside_end) = (
            (float(value[0]) for value in catenary.along(tower.place[None]))
            for tower in (first, last)
        )
        if -start > hidden or end - catenary.length > hidden:
            continue
        if max(abs(beside), abs(beside_end)) > REACH_M:
            continue
        whole = wire.between(start, end)
        if first.holds(whole.catenary.start[2]) and last.holds(whole.catenary.end[2]):
            yield whole
