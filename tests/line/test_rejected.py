"""A line without conductors that people rejected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fixtures.line_scene import known_line
from fixtures.true_line import wire_of

from scenenet.line.catenary import Catenary
from scenenet.line.find_line import find_line
from scenenet.line.notes import UNHELD
from scenenet.line.records import SurveyLine
from scenenet.line.rejected import without_conductors


@pytest.fixture(scope="module")
def scene():
    """A line of four poles, and what is found of it: three conductors in each span."""
    known = known_line(towers=4, kinds={"tubular": 1})
    return known, find_line(known.points, known.towers, known.to_its_ends)


def of_span(line: SurveyLine, span_id: int):
    return [each for each in line.conductors if each.span_id == span_id]


def test_a_row_of_twigs_that_is_rejected_leaves_the_span_as_it_was(scene):
    known, line = scene
    span = next(each for each in line.spans if each.from_tower and each.to_tower)
    own = of_span(line, span.span_id)
    assert [each.kind for each in own] == ["conductor"] * 3
    # A fourth wire, the highest, would be taken for an earth wire.
    twigs = _above(own[0].catenary, span.span_id)
    kinds = [*("conductor" for _ in own), "earth wire"]
    with_it = replace(
        line,
        conductors=(*line.conductors, twigs),
        spans=tuple(
            replace(each, earth_wires=1, worst_rmse=twigs.rmse) if each == span else each
            for each in line.spans
        ),
    )
    assert [each.kind for each in of_span(with_it, span.span_id)] == kinds
    left = without_conductors(with_it, known.towers, {(span.span_id, 4)})
    assert replace(left, rejected=()) == line
    assert left.rejected == (twigs,)
    assert SurveyLine.from_json(left.to_json()) == left


def _above(curve: Catenary, span_id: int):
    up = np.array([0.0, 0.0, 2.0])
    start, end = (tuple((np.array(place) + up).tolist()) for place in (curve.start, curve.end))
    raised = Catenary(start, end, curve.parameter, curve.blowout)
    return replace(wire_of(raised, span_id, 4, "earth wire"), rmse=0.4)


def test_what_counts_conductors_counts_those_that_are_left(scene):
    known, line = scene
    span = line.spans[1]
    left = without_conductors(line, known.towers, {(span.span_id, 1)})
    [changed] = [each for each in left.spans if each.span_id == span.span_id]
    assert changed.conductors == 2
    assert changed.worst_rmse == max(each.rmse for each in of_span(line, span.span_id)[1:])
    assert [each for each in left.spans if each != changed] == [
        each for each in line.spans if each != span
    ]


def test_a_span_without_conductors_is_gone_and_its_towers_are_listed(scene):
    known, line = scene
    first = next(each for each in line.spans if not each.from_tower or not each.to_tower)
    beyond = {each.span_id for each in line.spans} - {first.span_id}
    every = {(each.span_id, each.conductor_id) for each in line.conductors}
    left = without_conductors(line, known.towers, {k for k in every if k[0] == first.span_id})
    assert {each.span_id for each in left.spans} == beyond
    assert not {note.span_id for note in left.notes} & {first.span_id}
    nothing = without_conductors(line, known.towers, every)
    assert nothing.spans == nothing.conductors == nothing.supports == ()
    assert {note.tower for note in nothing.notes if note.what == UNHELD} == {
        tower.id for tower in known.towers
    }


def test_without_a_rejected_conductor_nothing_changes(scene):
    known, line = scene
    assert without_conductors(line, known.towers, set()) is line
