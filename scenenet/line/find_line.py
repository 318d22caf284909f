"""Find the lines of a survey: its conductors, its spans in order, and what contradicts them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from scenenet.detection.tower_ids import tower_ids
from scenenet.line.catenary import Catenary
from scenenet.line.edge_spans import Seen, survey_goes_on
from scenenet.line.graph import Chain, chains
from scenenet.line.notes import EXPECTED, UNHELD, UNTRACED, LineNote
from scenenet.line.records import Conductor, LineSpan, SurveyLine
from scenenet.line.spans import find_spans
from scenenet.line.supports import supports
from scenenet.line.traced_spans import REACH_M, LineTower, SpanWire, TracedSpan
from scenenet.line.untraced import untraced_spans
from scenenet.line.wire_points import WirePoints

PHASES = 3
"""Conductors of a circuit; what a span has beyond circuits are earth wires, the highest ones."""

MOST_EARTH_WIRES = 2

CABLE_WIRES, CABLE_M = 2, 60.0
"""Wires without any tower are cables of no line if there are at most so many and they are at most
so long, m: telephone cables and those to houses."""

SLACK = 0.5
"""Share of the usual catenary parameter of a line below which a wire is a cable that ends at or
passes a tower: telephone cables hang slacker than conductors."""

BELOW_M = 2.0
"""m, how much lower than all conductors that lead from its tower to another one a short wire is a
cable: one on the same pole, or under the line."""

SHOWN_M = 0.05
"""m, how much deeper than usual a wire hangs through from which it shows that it is slack: the
noise of its points. A short wire does not show it."""

OWN_SPANS = 3
"""Spans from which a line shows its own usual parameter; that of a shorter one is that of the
survey."""

SAME_TOWER_M = 2 * REACH_M
"""m, distance of places at which the same tower is expected: the wires of a missed one end at both
sides of its crossarms, and on both sides of it."""

TUBE_M, TUBE_RMSE = 0.25, 3.0
"""m from its catenary up to which points belong to a wire, at least, and in terms of its RMSE."""

BUNDLE_M = 0.35
"""m that a bundle reaches from its middle: half the diagonal of four subconductors."""


def find_line(
    points: WirePoints, towers: Sequence[LineTower], seen: Seen, progress: str | None = None
) -> SurveyLine:
    """The lines of a survey.

    Args:
        points: that may be on wires.
        towers: the towers found, m.
        seen: gives what the survey has around a place; it shows where the survey ends.
        progress: label of the progress on stderr; None shows no progress.
    """
    traced = find_spans(points, towers, seen, progress)
    lines = chains(traced)
    middles = [span.frame.to_map(np.array([[span.frame.length / 2, 0, 0]]))[0] for span in traced]
    ids = tower_ids(np.array(middles).reshape(-1, 3)[:, :2])
    lowest = _lowest_held(traced)
    spans: list[LineSpan] = []
    conductors: list[Conductor] = []
    notes: list[LineNote] = []
    number = 0
    for chain in lines:
        own_spans = [traced[step.number] for step in chain.steps]
        usual = _usual_parameter(own_spans if len(own_spans) >= OWN_SPANS else traced)
        cable = _is_cable(own_spans, usual, lowest)
        number += not cable
        for order, (step, angle) in enumerate(zip(chain.steps, chain.angles, strict=True), 1):
            span = _run_through(traced, chain, order - 1)
            span_id = ids[step.number]
            own = _conductors(span, span_id, None if cable else usual)
            ends, expected = ("cable", []) if cable else _ends(span, seen)
            notes += [
                LineNote(*place, EXPECTED, 0, span_id)
                for place in expected
                if not any(np.hypot(n.x - place[0], n.y - place[1]) <= SAME_TOWER_M for n in notes)
            ]
            kinds = [conductor.kind for conductor in own]
            spans.append(
                LineSpan(
                    start=span.place(0), end=span.place(1), span_id=span_id,
                    line=0 if cable else number, order=order,
                    from_tower=_id(span.start), to_tower=_id(span.end),
                    length=span.frame.length, angle=angle,
                    conductors=len(own) if cable else kinds.count("conductor"),
                    earth_wires=kinds.count("earth wire"),
                    worst_rmse=max(conductor.rmse for conductor in own), ends=ends,
                )
            )  # fmt: skip
            conductors += own
    notes += unheld(towers, spans)
    gaps = untraced_spans(towers, spans)
    notes += [gap.note for gap in gaps]
    at_gap = {span_id for gap in gaps for span_id in gap.span_ids}
    spans = [
        replace(span, ends=UNTRACED) if span.span_id in at_gap and span.ends != EXPECTED else span
        for span in spans
    ]
    held_by = supports(towers, spans, conductors)
    return SurveyLine(tuple(spans), tuple(conductors), tuple(notes), tuple(held_by))


def unheld(towers: Sequence[LineTower], spans: Sequence[LineSpan]) -> list[LineNote]:
    """The towers that no span of a line leads to."""
    held = {end for span in spans if span.line for end in (span.from_tower, span.to_tower)}
    return [
        LineNote(tower.x, tower.y, UNHELD, tower.id, 0) for tower in towers if tower.id not in held
    ]


def _is_cable(spans: Sequence[TracedSpan], usual: float, lowest: Mapping[int, float]) -> bool:
    """Whether wires are those of no line: few and short ones that no tower holds, or that hang
    below the conductors of their tower, or all of them slack.

    Args:
        usual: m, catenary parameter of the line.
        lowest: of ``_lowest_held``.
    """

    def is_loose(span: TracedSpan) -> bool:
        if len(span.wires) > CABLE_WIRES or span.frame.length > CABLE_M:
            return False
        if span.start is None and span.end is None:
            return True
        return (span.start is None or span.end is None) and all(
            height < lowest.get(tower, -np.inf) - BELOW_M for tower, height in _attachments(span)
        )

    return all(map(is_loose, spans)) or all(
        _is_slack(wire.catenary, usual) for span in spans for wire in span.wires
    )


def _lowest_held(spans: Sequence[TracedSpan]) -> dict[int, float]:
    """Id of each tower with a span to another one -> m, elevation of its lowest wire of these."""
    lowest: dict[int, float] = {}
    for span in spans:
        if span.start is not None and span.end is not None:
            for tower, height in _attachments(span):
                lowest[tower] = min(height, lowest.get(tower, np.inf))
    return lowest


def _attachments(span: TracedSpan) -> Iterator[tuple[int, float]]:
    """The towers of a span, each with the elevation in m of each wire there."""
    for wire in span.wires:
        for tower, place in ((span.start, wire.catenary.start), (span.end, wire.catenary.end)):
            if tower is not None:
                yield tower.id, place[2]


def _is_slack(curve: Catenary, usual: float) -> bool:
    """Whether a wire shows that it is slacker than wires of its line, whose parameter is usually
    ``usual`` m."""
    deeper = curve.length**2 / 8 * (1 / curve.parameter - 1 / usual)
    return curve.parameter < SLACK * usual and deeper >= SHOWN_M


def _usual_parameter(spans: Sequence[TracedSpan]) -> float:
    """m, median catenary parameter of the wires of a line."""
    return float(np.median([wire.catenary.parameter for span in spans for wire in span.wires]))


def _run_through(spans: Sequence[TracedSpan], chain: Chain, index: int) -> TracedSpan:
    """A span as its line runs through it, with its wires attached in the planes of the crossarms.

    Crossarms halve the angle of the line at their tower.
    """
    ways = []
    for number, turned in chain.steps[max(index - 1, 0) : index + 2]:
        ways.append(spans[number].frame.direction * (-1 if turned else 1))
    own = ways[1] if index > 0 else ways[0]
    before = ways[0] if index > 0 else own
    after = ways[-1] if index + 1 < len(chain.steps) else own
    step = chain.steps[index]
    span = _turned(spans[step.number]) if step.turned else spans[step.number]
    planes = (span.start, own + before), (span.end, own + after)
    wires = []
    for wire in span.wires:
        reach = [0.0, wire.catenary.length]
        for end, (tower, along) in enumerate(planes):
            if tower is not None:
                away = (tower.place - wire.catenary.start[:2]) @ along
                reach[end] = float(away / (wire.catenary.direction @ along))
        wires.append(wire.between(*reach))
    return replace(span, wires=tuple(wires))


def _turned(span: TracedSpan) -> TracedSpan:
    """The span in the other direction."""
    frame = span.frame
    x, y, _ = frame.to_map(np.array([[frame.length, 0.0, 0.0]]))[0].tolist()
    wires = (
        replace(
            wire,
            catenary=Catenary(w.end, w.start, w.parameter, -w.blowout),
            offsets=wire.offsets * [-1.0, 1.0],
        )
        for wire in span.wires for w in (wire.catenary,)
    )  # fmt: skip
    other = replace(frame, x=x, y=y, direction=-frame.direction)
    return TracedSpan(span.end, span.start, other, tuple(wires))


def _conductors(span: TracedSpan, span_id: int, usual: float | None) -> list[Conductor]:
    """The conductors of a span, numbered from left to right and from the top. Wires that are
    slacker than the ``usual`` parameter in m are cables; all of them are if it is None."""

    def is_cable(wire: SpanWire) -> bool:
        return usual is None or _is_slack(wire.catenary, usual)

    def place(wire: SpanWire) -> tuple[float, float]:
        middle = wire.catenary.at_shares(np.array([0.5]))
        _, left, z = span.frame.to_frame(middle)[0].tolist()
        return -round(left, 1), -z

    wires = sorted(span.wires, key=place)
    own = [wire for wire in wires if not is_cable(wire)]
    earth = {id(own[number]) for number in earth_wires([wire.catenary for wire in own])}
    found = []
    for number, wire in enumerate(wires):
        curve = wire.catenary
        kind = "earth wire" if id(wire) in earth else "conductor"
        if is_cable(wire):
            kind = "cable"
        tube = max(TUBE_M, TUBE_RMSE * wire.rmse) + (BUNDLE_M if len(wire.offsets) > 1 else 0.0)
        heights = (
            0.0 if tower is None else z - tower.base
            for tower, z in ((span.start, curve.start[2]), (span.end, curve.end[2]))
        )
        from_height, to_height = heights
        found.append(
            Conductor(
                catenary=curve, tube=tube, offsets=tuple(map(tuple, wire.offsets.tolist())),
                span_id=span_id, conductor_id=number + 1, kind=kind,
                subconductors=len(wire.offsets), from_tower=_id(span.start),
                to_tower=_id(span.end), c=curve.parameter, sag=curve.sag, blowout=curve.blowout,
                length=curve.length,
                rmse=wire.rmse, points=len(wire.rows), seen=wire.covered,
                from_z=curve.start[2], to_z=curve.end[2],
                from_height=from_height, to_height=to_height,
            )
        )  # fmt: skip
    return found


def earth_wires(wires: Sequence[Catenary]) -> set[int]:
    """Numbers of the earth wires among those of a span that are no cables: those above full
    circuits, if they are the highest ones."""
    over = len(wires) % PHASES
    if over == 0 or over > MOST_EARTH_WIRES or len(wires) < PHASES:
        return set()
    height = [wire.start[2] + wire.end[2] for wire in wires]
    return set(np.argsort(height, kind="stable")[-over:].tolist())


def _ends(span: TracedSpan, seen: Seen) -> tuple[str, list[tuple[float, float]]]:
    """What is known of the ends of a span, and the places (x, y) m at which towers are
    expected."""
    expected, leaves = [], False
    for end, tower in enumerate((span.start, span.end)):
        if tower is not None:
            continue
        if survey_goes_on(span, end, seen):
            expected.append(span.place(end))
        else:
            leaves = True
    if expected:
        return EXPECTED, expected
    return ("leaves the survey" if leaves else "between towers"), []


def _id(tower: LineTower | None) -> int:
    return 0 if tower is None else tower.id
