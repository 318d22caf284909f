"""What the map of a survey shows of its line, as SVG."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from scenenet.clearance.records import SurveyClearances
from scenenet.line.records import EXPECTED, FOUND_AGAIN, PASSED, UNHELD, Conductor, SurveyLine
from scenenet.prediction.page.budget import MOST_MARKS
from scenenet.prediction.page.frame import MapFrame
from scenenet.prediction.page.span_facts import SpanFacts

BLOWN_M = 0.05
"""m that wind moves a wire to one side from which the map shows it as a curve."""

BENDS = 8
"""Pieces of such a curve."""

RINGS = "expected", "again", "unheld"
"""Marks that are rings."""

KINDS = {"conductor": "wire", "earth wire": "wire earth", "cable": "wire cable"}
"""Kind of a wire -> class of its path."""


def line_shapes(
    line: SurveyLine,
    spans: Sequence[SpanFacts],
    clearances: SurveyClearances | None,
    frame: MapFrame,
    planar: float,
) -> list[str]:
    """The spans, wires and places of a line as SVG elements, what lies below first.

    Args:
        planar: size in m of the unit of x and y.
    """
    shapes = [_span(one, frame, planar) for one in spans]
    shapes += [
        f'<path class="{name}" d="{path}"/>'
        for kind, name in KINDS.items()
        if (path := _wires((w for w in line.conductors if w.kind == kind), frame, planar))
    ]
    found = clearances or SurveyClearances((), (), (), (), "", "")
    # What stands last is on top: the worst.
    trees = [(tree.x, tree.y) for tree in found.trees[:MOST_MARKS]][::-1]
    dangers = [(place.x, place.y) for place in found.dangers[:MOST_MARKS]][::-1]
    free = [
        place
        for span in line.spans
        if span.ends == "leaves the survey"
        for place, tower in ((span.start, span.from_tower), (span.end, span.to_tower))
        if not tower
    ]
    for name, places in (
        ("fall", trees),
        ("danger", dangers),
        ("outside", free),
        ("expected", [(n.x, n.y) for n in line.notes if n.what == EXPECTED]),
        ("again", [(n.x, n.y) for n in line.notes if n.what == FOUND_AGAIN]),
        ("unheld", [(n.x, n.y) for n in line.notes if n.what == UNHELD]),
        ("passed", [(n.x, n.y) for n in line.notes if n.what == PASSED]),
    ):
        shapes += _marks(name, places, frame, planar)
    return shapes


def _span(facts: SpanFacts, frame: MapFrame, planar: float) -> str:
    start, end = (frame.place(*(np.array(e) / planar)) for e in (facts.span.start, facts.span.end))
    return f'<path class="span {facts.state}" data-span="{facts.span.span_id}" d="M{start}L{end}"/>'


def _wires(wires: Iterable[Conductor], frame: MapFrame, planar: float) -> str:
    paths = []
    for wire in wires:
        pieces = BENDS if abs(wire.blowout) > BLOWN_M else 1
        xy = wire.catenary.at_shares(np.linspace(0, 1, pieces + 1))[:, :2] / planar
        paths.append("M" + "L".join(frame.place(*place) for place in xy.tolist()))
    return "".join(paths)


def _marks(
    name: str, places: Sequence[tuple[float, float]], frame: MapFrame, planar: float
) -> list[str]:
    """Marks that do not grow with the map: strokes without length, whose caps show. A wider one
    below makes a ring of the upper one."""
    if not places:
        return []
    path = "".join(f"M{frame.place(x / planar, y / planar)}h0" for x, y in places)
    ring = [f'<path class="{name} ring" d="{path}"/>'] if name in RINGS else []
    return [*ring, f'<path class="{name}" d="{path}"/>']
