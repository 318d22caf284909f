"""How near the wires of other lines are, catenary to catenary."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from scenenet.clearance.distance import nearest_on
from scenenet.line.catenary import Catenary
from scenenet.line.records import Conductor, LineSpan, SurveyLine

SAMPLE_M = 1.0
"""m, steps along a wire at which its distance from another one is looked at first."""

REFINED = 8
"""Times that the steps around the nearest place become finer, by a factor of ten in two."""

ON_POLE_M = 2.5
"""m from the axis of a tower up to which a cable is held there: poles hold cables without a
crossarm, and some by a short one. Others pass the tower."""


@dataclass(frozen=True)
class Crossing:
    """The nearest places of two wires of different lines.

    Attributes:
        conductor: that is measured.
        other: the wire near it.
        along, other_along: m, from the start of each.
        distance: m, in space.
    """

    conductor: Conductor
    other: Conductor
    along: float
    other_along: float
    distance: float


def crossings(line: SurveyLine, reach: float) -> Iterator[Crossing]:
    """For each conductor of a line, the nearest wire of each other span within ``reach`` m, in the
    order of the conductors. Wires of the same line, and those that share a tower, do not cross. A
    cable does where it passes the tower that it seems to end at."""
    spans = {span.span_id: span for span in line.spans}
    wires = line.conductors
    if not wires:
        return
    low = np.array([np.minimum(w.catenary.start, w.catenary.end)[:2] for w in wires]) - reach / 2
    high = np.array([np.maximum(w.catenary.start, w.catenary.end)[:2] for w in wires]) + reach / 2
    for row, wire in enumerate(wires):
        if wire.kind == "cable":
            continue
        near = ((low <= high[row]) & (high >= low[row])).all(axis=1)
        found: dict[int, Crossing] = {}
        for number in np.flatnonzero(near).tolist():
            other = wires[number]
            if not _apart(spans[wire.span_id], spans[other.span_id], other):
                continue
            u, v, distance = nearest_places(wire.catenary, other.catenary)
            known = found.get(other.span_id)
            if distance <= reach and (known is None or distance < known.distance):
                found[other.span_id] = Crossing(wire, other, u, v, distance)
        yield from found.values()


def _apart(own: LineSpan, other: LineSpan, wire: Conductor) -> bool:
    """Whether two spans are of different lines, or ``wire`` of the other one is a cable that passes
    their towers."""
    if own.span_id == other.span_id:
        return False
    towers = {own.from_tower, own.to_tower} - {0}
    ends = [
        (wire.catenary.start, other.start if other.from_tower in towers else None),
        (wire.catenary.end, other.end if other.to_tower in towers else None),
    ]
    away = [np.hypot(x - foot[0], y - foot[1]) for (x, y, _), foot in ends if foot is not None]
    if wire.kind == "cable" and away:
        return min(away) > ON_POLE_M
    return not away and not (own.line == other.line and own.line)


def nearest_places(first: Catenary, second: Catenary) -> tuple[float, float, float]:
    """m along each of two wires at their nearest places, and the distance there in m."""
    low, high = 0.0, first.length
    steps = 2 + int(first.length / SAMPLE_M)
    for _ in range(REFINED):
        u = np.linspace(low, high, steps)
        on = nearest_on(second, first.at(u))
        best = int(np.argmin(on.distance))
        apart = (high - low) / (steps - 1)
        low, high = max(u[best] - apart, 0.0), min(u[best] + apart, first.length)
        steps = 9
    return float(u[best]), float(on.along[best]), float(on.distance[best])
