"""Wires of a tower at the edge of a survey, which are too short to be found without the tower."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from scenenet.detection.conductor_rules import NEAR
from scenenet.line.frame import SpanFrame
from scenenet.line.lone_wires import LINKED_M, PARALLEL, is_wire, spans_by_towers
from scenenet.line.traced_spans import REACH_M, LineTower, TracedSpan, traced
from scenenet.line.wire_points import WirePoints

EDGE_M = 35.0
"""m from the axis of a tower up to which its wires are looked for here. Longer ones show without it
that they are wires, and where they lead."""

SHORTEST_WIRE_M = 6.0
"""m, length of a wire between its first and its last point, at least. Members of crossarms that
point along the line are shorter."""

TURNED, STEP = 12.0, 0.5
"""Degrees by which the wires may turn from the bearing that the tower has, and steps in which their
direction is looked for: over 20 m, one of 12 degrees leads from a crossarm to the axis."""

BEYOND_M, AROUND_M = 15.0, 5.0
"""m, distance beyond the end of a wire at which points show that the survey goes on, and radius
around that place."""

LANE_M = 0.5
"""m, width of the lanes along the wires in which points are counted."""

Seen = Callable[[np.ndarray, float], np.ndarray]
"""Gives the positions (M, 3) m of what is within a radius in m of a place (2,)."""


def edge_spans(
    points: WirePoints,
    free: np.ndarray,
    towers: Sequence[LineTower],
    found: Sequence[TracedSpan],
    seen: Seen,
) -> Iterator[TracedSpan]:
    """The spans that leave a tower where its surroundings show conductors and no span was found,
    and that leave the survey as well.

    Args:
        free: (N,) bool, points that are on no wire yet.
        found: the spans so far.
        seen: gives what the survey has around a place.
    """
    for tower in towers:
        for bearing in np.radians(tower.bearings):
            direction = np.array([np.sin(bearing), np.cos(bearing)])
            if not _is_found(found, tower, direction):
                for span in _leaving(points, free, tower, direction):
                    if not survey_goes_on(span, int(span.start is tower), seen):
                        yield span


def survey_goes_on(span: TracedSpan, end: int, seen: Seen) -> bool:
    """Whether the survey goes on beyond the start, 0, or the end, 1, of a span."""
    way = span.frame.direction * (1.0 if end else -1.0)
    return len(seen(np.array(span.place(end)) + BEYOND_M * way, AROUND_M)) > 0


def _leaving(
    points: WirePoints, free: np.ndarray, tower: LineTower, direction: np.ndarray
) -> Iterator[TracedSpan]:
    """The span that leaves a tower in about a direction, if its wires end before ``EDGE_M``."""
    frame = _along_wires(points, free, tower, direction)
    rows = _rows(points, free, frame)
    if len(rows) == 0:
        return
    s, _ = frame.in_plan(points.xyz[rows])
    ordered = np.sort(s)
    breaks = np.flatnonzero(np.diff(ordered) > LINKED_M)
    end = float(ordered[breaks[0]] if len(breaks) else ordered[-1])
    if end > EDGE_M - LINKED_M:
        return
    rows = rows[(s >= NEAR) & (s <= end)]
    wires = [
        wire
        for wire in traced(points, rows, replace(frame, length=end))
        if wire.catenary.length >= SHORTEST_WIRE_M and is_wire(wire)
    ]
    yield from spans_by_towers(wires, [tower])


def _along_wires(
    points: WirePoints, free: np.ndarray, tower: LineTower, direction: np.ndarray
) -> SpanFrame:
    """The frame from a tower, ``EDGE_M`` long, along which most points are one behind another."""
    frame = SpanFrame(tower.x, tower.y, direction, EDGE_M)
    east, north = (points.xyz[_rows(points, free, frame), :2] - tower.place).T
    best, most = frame, -1
    for turn in np.radians(np.arange(-TURNED, TURNED + STEP, STEP)):
        dx, dy = direction @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        lanes = np.floor((north * dx - east * dy) / LANE_M)
        _, count = np.unique(lanes, return_counts=True)
        if (together := int((count**2).sum())) > most:
            best, most = replace(frame, direction=np.array([dx, dy])), together
    return best


def _rows(points: WirePoints, free: np.ndarray, frame: SpanFrame) -> np.ndarray:
    """Rows (n,) of the certain points in a frame that are on no wire yet."""
    rows = points.beside(frame, REACH_M)
    return rows[free[rows] & points.certain[rows]]


def _is_found(found: Sequence[TracedSpan], tower: LineTower, direction: np.ndarray) -> bool:
    """Whether a span leaves a tower in about this direction."""
    # The bearing and the span may each differ from its wires by as much as two stretches of it.
    ways = [span.frame.direction for span in found if span.start is tower]
    ways += [-span.frame.direction for span in found if span.end is tower]
    return any(float(way @ direction) >= np.cos(np.radians(2 * PARALLEL)) for way in ways)
