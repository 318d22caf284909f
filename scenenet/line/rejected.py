"""The line without conductors that people rejected."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

from scenenet.line.find_line import earth_wires, unheld
from scenenet.line.notes import UNHELD
from scenenet.line.records import Conductor, LineSpan, SurveyLine
from scenenet.line.supports import supports
from scenenet.line.traced_spans import LineTower


def without_conductors(
    line: SurveyLine, towers: Sequence[LineTower], rejected: Set[tuple[int, int]]
) -> SurveyLine:
    """A line without some of its conductors, which are its ``rejected`` ones then.

    What follows from the conductors of a span follows from those that are left: which of them are
    earth wires, their numbers, the worst RMSE, and what the towers hold. A span without any is
    left out. All numbers that name something stay as they are: ids, lines, and places along them.

    Args:
        towers: of the survey.
        rejected: (``span_id``, ``conductor_id``) of conductors.
    """
    if not rejected:
        return line
    gone = [each for each in line.conductors if (each.span_id, each.conductor_id) in rejected]
    changed = {each.span_id for each in gone}
    spans: list[LineSpan] = []
    conductors: list[Conductor] = []
    for span in line.spans:
        own = [each for each in line.conductors if each.span_id == span.span_id]
        if span.span_id in changed:
            own = _with_kinds([e for e in own if (e.span_id, e.conductor_id) not in rejected])
            if not own:
                continue
            span = _counted(span, own)
        spans.append(span)
        conductors += own
    left = {span.span_id for span in spans}
    noted = {note.tower for note in line.notes if note.what == UNHELD}
    return replace(
        line,
        spans=tuple(spans),
        conductors=tuple(conductors),
        notes=(
            *(note for note in line.notes if note.span_id in left | {0}),
            *(note for note in unheld(towers, spans) if note.tower not in noted),
        ),
        supports=tuple(supports(towers, spans, conductors)),
        rejected=(*line.rejected, *gone),
    )


def _with_kinds(conductors: Sequence[Conductor]) -> list[Conductor]:
    """Conductors of a span, each with the kind that it has among these."""
    wires = [each for each in conductors if each.kind != "cable"]
    earth = {wires[n].conductor_id for n in earth_wires([each.catenary for each in wires])}
    return [
        each
        if each.kind == "cable"
        else replace(each, kind="earth wire" if each.conductor_id in earth else "conductor")
        for each in conductors
    ]


def _counted(span: LineSpan, conductors: Sequence[Conductor]) -> LineSpan:
    """A span with these conductors."""
    kinds = [each.kind for each in conductors]
    return replace(
        span,
        # A span of no line has cables only.
        conductors=kinds.count("conductor") if span.line else len(kinds),
        earth_wires=kinds.count("earth wire"),
        worst_rmse=max(each.rmse for each in conductors),
    )
