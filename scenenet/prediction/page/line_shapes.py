"""What the map of a survey shows of its line, as SVG."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from scenenet.clearance.records import SurveyClearances
from scenenet.line.notes import NOTE_KINDS, UNTRACED, NoteKind
from scenenet.line.records import Conductor, SurveyLine
from scenenet.prediction.page.budget import MOST_MARKS
from scenenet.prediction.page.frame import MapFrame
from scenenet.prediction.page.span_facts import SpanFacts

BLOWN_M = 0.05
"""m that wind moves a wire to one side from which the map shows it as a curve."""

BENDS = 8
"""Pieces of such a curve."""

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
        if span.ends in ("leaves the survey", UNTRACED)
        for place, tower in ((span.start, span.from_tower), (span.end, span.to_tower))
        if not tower
    ]
    for name, places in (("fall", trees), ("danger", dangers), ("outside", free)):
        shapes += _marks([name], places, frame, planar)
    for what, kind in NOTE_KINDS.items():
        places = [(note.x, note.y) for note in line.notes if note.what == what]
        shapes += _marks(_ring(kind), places, frame, planar)
    return shapes


def note_key() -> str:
    """What the key of the map says of each kind of places to look at, as HTML."""
    items = []
    for what, kind in NOTE_KINDS.items():
        side = 20 if kind.at_tower else 16
        paths = "".join(f'<path class="{n}" d="M{side // 2} {side // 2}h0"/>' for n in _ring(kind))
        svg = f'<svg width="{side}" height="{side}" aria-hidden="true">{paths}</svg>'
        items.append(f"    <li>{svg} {escape(what)}</li>")
    return "\n".join(items)


def _ring(kind: NoteKind) -> list[str]:
    """Classes of a ring: of what lies below, and of what lies on it."""
    name = f"look at-tower {kind.mark}" if kind.at_tower else f"look {kind.mark}"
    return [f"{name} ring", name]


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
    names: Sequence[str], places: Sequence[tuple[float, float]], frame: MapFrame, planar: float
) -> list[str]:
    """Marks that do not grow with the map: strokes without length, whose caps show. One of each
    class of ``names`` lies on the one before."""
    if not places:
        return []
    path = "".join(f"M{frame.place(x / planar, y / planar)}h0" for x, y in places)
    return [f'<path class="{name}" d="{path}"/>' for name in names]
