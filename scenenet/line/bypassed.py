"""Towers that the line contradicts: a span goes on past them with its conductors.

A tree beside the conductors may be taken for a tower, because they seem to leave it. The span
between the towers before and after it is traced nevertheless, and the tree holds none of its
conductors, or one of many. ``scenenet.line.passed`` finds those that divide a span.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenenet.detection.conductor_rules import BEND, POLE_M, SECTOR
from scenenet.line.frame import SpanFrame
from scenenet.line.graph import STRAY
from scenenet.line.records import Conductor, LineSpan
from scenenet.line.traced_spans import REACH_M, LineTower

CROWN_M = 6.0
"""m in plan from the nearest conductor of a span within which a tree may be taken for its tower:
the reach of a crown. Towers of a line next to this one stand further away."""


def bypassed_towers(
    towers: Sequence[LineTower], spans: Sequence[LineSpan], conductors: Sequence[Conductor]
) -> set[int]:
    """Ids of the towers beside a span between two others that have no conductors but those of it.

    Such a tower holds no wire, and those of the span pass further above it than it can hold them,
    or would bend there if something wider than a pole held them; or it holds few of them in the
    direction of the span, whose conductors would bend there if they were carried. A tower from
    which a wire leads to a third one is of another line.

    Args:
        towers: of the survey, m.
        spans, conductors: of its lines.
    """
    wires: dict[int, list[Conductor]] = {span.span_id: [] for span in spans}
    for conductor in conductors:
        wires[conductor.span_id].append(conductor)
    whole = [span for span in spans if span.line and span.from_tower and span.to_tower]
    found = set()
    for tower in towers:
        own = [span for span in spans if tower.id in (span.from_tower, span.to_tower)]
        reached = {each for one in own for each in (one.from_tower, one.to_tower)} - {tower.id}
        held = [own_wires for one in own if (own_wires := _no_cables(wires[one.span_id]))]
        for span in whole:
            ends = {0, span.from_tower, span.to_tower}
            if tower.id not in ends and reached <= ends:
                found |= {tower.id} if _passes(span, wires[span.span_id], tower, held) else set()
    return found


def _passes(
    span: LineSpan,
    wires: Sequence[Conductor],
    tower: LineTower,
    held: Sequence[Sequence[Conductor]],
) -> bool:
    """Whether the wires of a span go on past a tower that holds others, those of each span."""
    frame = SpanFrame.between(np.array(span.start), np.array(span.end))
    s, t, _ = frame.to_frame(np.array([[tower.x, tower.y, 0.0]]))[0].tolist()
    if not 0 < s < frame.length or abs(t) > REACH_M:
        return False
    places = [_beside(wire, tower) for wire in wires]
    if min(abs(beside) for beside, _ in places) > CROWN_M:
        return False
    bend = span.length / (4 * float(np.median([wire.c for wire in wires])))
    if not held:
        bearings = np.radians(tower.bearings)
        ways = np.column_stack((np.sin(bearings), np.cos(bearings)))
        # A pole at their height may be of another line, whose wires were not traced.
        wide = tower.width is not None and tower.width > POLE_M
        unheld = (wide and bend >= BEND) or not any(tower.holds(z) for _, z in places)
        return bool(_along(ways, frame).any()) and unheld
    ways = np.array([wire.catenary.direction for each in held for wire in each])
    few = max(map(len, held)) < STRAY * len(wires)
    return few and bool(_along(ways, frame).all()) and bend >= BEND


def _no_cables(wires: Sequence[Conductor]) -> list[Conductor]:
    return [wire for wire in wires if wire.kind != "cable"]


def _beside(wire: Conductor, tower: LineTower) -> tuple[float, float]:
    """m to the left of a wire at which a tower stands, and the elevation of the wire there."""
    s, beside = wire.catenary.along(tower.place[None])
    return float(beside[0]), float(wire.catenary.at(s)[0, 2])


def _along(ways: np.ndarray, frame: SpanFrame) -> np.ndarray:
    """(n,) bool, which of these unit vectors (n, 2) run along a frame, to either end."""
    along: np.ndarray = np.abs(ways @ frame.direction) >= np.cos(np.radians(SECTOR))
    return along
