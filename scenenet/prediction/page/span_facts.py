"""What is known of each span of a survey, and which spans a person should look at first."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from scenenet.clearance.records import Clearance, FallTree, SpanClearance, SurveyClearances
from scenenet.line.notes import NOTE_KINDS
from scenenet.line.records import Conductor, LineSpan, SurveyLine
from scenenet.pointcloud.units import SYMBOLS

ROUGH_M = 0.15
"""m, RMSE of a conductor from which a person should look at it. Ranging noise and the swing of a
wire leave some centimetres."""

LITTLE = 0.5
"""Share of its length on which a conductor has points below which a person should look at it."""

DANGER, CHECK, FOUND = STATES = ("danger", "check", "found")
"""What is known of a span: something is too near, there is a reason to doubt it, or neither."""

Row = TypeVar("Row", Conductor, Clearance, FallTree)


@dataclass(frozen=True)
class SpanFacts:
    """What is known of a span.

    Attributes:
        span: the span.
        conductors: in their order.
        clearance: the worst of what is near; None where that was not measured: at cables.
        nearest: of each kind the nearest place of all its conductors, the worst first.
        dangers: the places closer than the limit, the worst first.
        trees: that could fall on it, the worst first.
        doubts: reasons for a person to look at it, as sentences.
    """

    span: LineSpan
    conductors: tuple[Conductor, ...]
    clearance: SpanClearance | None
    nearest: tuple[Clearance, ...]
    dangers: tuple[Clearance, ...]
    trees: tuple[FallTree, ...]
    doubts: tuple[str, ...]

    @property
    def state(self) -> str:
        """One of ``STATES``."""
        if self.dangers:
            return DANGER
        return CHECK if self.doubts else FOUND

    @property
    def worst(self) -> Clearance | None:
        """The place with the smallest margin, or without limits the smallest distance."""
        places = [*self.dangers[:1], *self.nearest[:1]]
        return min(places, key=lambda place: place.order, default=None)


def span_facts(
    line: SurveyLine, clearances: SurveyClearances | None, planar: tuple[float, str]
) -> list[SpanFacts]:
    """What is known of each span, the worst first: by clearances as in their list, then by doubts.

    Args:
        planar: size in m of the unit of x and y of the survey, and its name.
    """
    conductors = _by_span(line.conductors)
    usual = _usual_conductors(line.spans)
    rows = {} if clearances is None else {row.span_id: row for row in clearances.spans}
    places = _by_span(() if clearances is None else clearances.places)
    trees = _by_span(() if clearances is None else clearances.trees)
    facts = []
    for span in line.spans:
        own = conductors[span.span_id]
        near = places[span.span_id]
        facts.append(
            SpanFacts(
                span, tuple(own), rows.get(span.span_id), _nearest(near),
                tuple(place for place in near if place.what == "danger"),
                tuple(trees[span.span_id]),
                _doubts(span, own, usual.get(span.line), planar),
            )
        )  # fmt: skip
    rank = {span_id: number for number, span_id in enumerate(rows)}
    return sorted(facts, key=lambda one: (rank.get(one.span.span_id, len(rank)), -len(one.doubts)))


def _by_span(rows: Iterable[Row]) -> Mapping[int, list[Row]]:
    found: dict[int, list[Row]] = defaultdict(list)
    for row in rows:
        found[row.span_id].append(row)
    return found


def _nearest(places: Sequence[Clearance]) -> tuple[Clearance, ...]:
    """Of each kind the first of places, which are sorted worst first."""
    found: dict[str, Clearance] = {}
    for place in places:
        found.setdefault(place.kind, place)
    return tuple(found.values())


def _usual_conductors(spans: Sequence[LineSpan]) -> dict[int, int]:
    """Number of conductors that most spans of each line have; lines of two spans have none."""
    counts: dict[int, Counter[int]] = defaultdict(Counter)
    for span in spans:
        counts[span.line][span.conductors] += 1
    return {
        line: of.most_common(1)[0][0]
        for line, of in counts.items()
        if line and of.most_common(1)[0][1] > 2
    }


def _doubts(
    span: LineSpan,
    conductors: Sequence[Conductor],
    usual: int | None,
    planar: tuple[float, str],
) -> tuple[str, ...]:
    size, unit = planar[0], SYMBOLS.get(planar[1], planar[1])
    reasons = []
    if span.ends in NOTE_KINDS:
        reasons.append(NOTE_KINDS[span.ends].of_span)
    if usual is not None and span.line and span.conductors != usual:
        reasons.append(
            f"it has {span.conductors} conductors, and most spans of its line have {usual}"
        )
    rough = [wire for wire in conductors if wire.rmse > ROUGH_M]
    if rough:
        worst = max(rough, key=lambda wire: wire.rmse)
        reasons.append(
            f"the points of conductor {worst.conductor_id} are {worst.rmse / size:.2f} {unit} from "
            "its catenary (RMSE): it may be more than one wire"
        )
    little = [wire.conductor_id for wire in conductors if wire.seen < LITTLE]
    if little:
        named = ", ".join(map(str, little))
        reasons.append(
            f"conductor{'s' * (len(little) > 1)} {named}: points on less than half of the length"
        )
    return tuple(reasons)
