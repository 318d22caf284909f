"""What the page of a survey says of each span, and the picture of its points."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from scenenet.clearance.records import Clearance, SpanClearance, SurveyClearances
from scenenet.line.catenary import Catenary
from scenenet.line.notes import EXPECTED, UNTRACED
from scenenet.line.records import Conductor, LineSpan, SurveyLine
from scenenet.prediction.page.span_facts import CHECK, DANGER, FOUND, span_facts
from scenenet.prediction.page.span_list import LengthUnits, span_rows
from scenenet.prediction.page.span_pictures import PICTURED, SpanPicture

FOOT = 0.3048
METRES, FEET = LengthUnits(1, 1, "m", "m"), LengthUnits(FOOT, FOOT, "ft", "ft")


def span(number: int, **changed) -> LineSpan:
    x = 100.0 * number
    known = LineSpan(
        (x, 0.0), (x + 100, 0.0), span_id=number, line=1, order=number, from_tower=number,
        to_tower=number + 1, length=100.0, angle=0.0, conductors=3, earth_wires=0,
        worst_rmse=0.03, ends="between towers",
    )  # fmt: skip
    return replace(known, **changed)


def conductor(number: int, **changed) -> Conductor:
    curve = Catenary((100.0 * number, 0.0, 20.0), (100.0 * number + 100, 0.0, 20.0), 900.0)
    known = Conductor(
        catenary=curve, tube=0.25, offsets=((0.0, 0.0),), span_id=number, conductor_id=1,
        kind="conductor", subconductors=1, from_tower=number, to_tower=number + 1, c=900.0,
        sag=curve.sag, blowout=0.0, length=100.0, rmse=0.03, points=500, seen=1.0,
        from_z=20.0, to_z=20.0, from_height=18.0, to_height=18.0,
    )  # fmt: skip
    return replace(known, **changed)


def place(number: int, what: str, distance: float, limit: float | None) -> Clearance:
    return Clearance(
        span_id=number, conductor_id=1, conductor_kind="conductor", what=what, kind="vegetation",
        distance=distance, vertical=distance, horizontal=0.0, limit=limit,
        margin=None if limit is None else distance - limit, points=9, note="", along=50.0,
        x=100.0 * number + 50, y=0.0, z=10.0, wire_x=100.0 * number + 50, wire_y=0.0,
        wire_z=10.0 + distance, other_span=0, kinds="", positions="",
    )  # fmt: skip


def row(number: int) -> SpanClearance:
    return SpanClearance(
        span_id=number, line=1, order=number, from_tower=number, to_tower=number + 1,
        worst_kind="vegetation", worst_margin=None, ground=None, vegetation=3.0, building=None,
        wire=None, dangers=0, few_points=0, danger_points=0, fall_trees=0, fall_margin=None,
        kinds="", limits="", positions="",
    )  # fmt: skip


def facts(spans, conductors, places=(), order=()):
    line = SurveyLine(tuple(spans), tuple(conductors), ())
    near = SurveyClearances(tuple(places), (), tuple(row(n) for n in order), (), "", "")
    return span_facts(line, near, (1.0, "metre"))


def test_each_reason_to_look_at_a_span_is_named():
    spans = [
        span(1),
        span(2, ends=EXPECTED),
        span(3, conductors=2),
        span(4),
        span(5, ends=UNTRACED),
    ]
    wires = [conductor(n) for n in (1, 2, 3)]
    wires += [conductor(4, rmse=0.4), conductor(5, seen=0.3, conductor_id=2)]
    found = facts(spans, wires)
    reasons = {one.span.span_id: " ".join(one.doubts) for one in found}
    assert reasons[1] == ""
    assert "a tower is expected" in reasons[2]
    assert "2 conductors, and most spans of its line have 3" in reasons[3]
    assert "conductor 1 are 0.40 m" in reasons[4]
    assert "no span was traced" in reasons[5]
    assert "conductor 2: points on less than half" in reasons[5]
    assert {one.state for one in found if one.doubts} == {CHECK}


def test_the_worst_span_comes_first_and_one_that_was_not_measured_last():
    spans = [span(1), span(2), span(3, line=0, ends="cable")]
    places = [place(2, "danger", 1.0, 4.0), place(1, "nearest", 6.0, 4.0)]
    found = facts(spans, map(conductor, (1, 2, 3)), places=places, order=(2, 1))
    assert [one.span.span_id for one in found] == [2, 1, 3]
    assert [one.state for one in found] == [DANGER, FOUND, FOUND]
    assert found[0].worst.distance == 1.0 and found[2].worst is None


@pytest.mark.parametrize("units", [METRES, FEET])
def test_the_list_is_in_the_units_of_the_survey(units):
    found = facts(
        [span(1)], [conductor(1)], places=[place(1, "danger", 1.5, 4.0)], order=(1,)
    )  # fmt: skip
    cells = re.findall(r'<td class="[^"]*">([^<]*)</td>', span_rows(found, units))
    lengths = [f"{metres / units.planar_m:.2f}" for metres in (1.5, -2.5)]
    assert cells[:3] == ["vegetation", *lengths]
    assert f"{100 / units.planar_m:.1f}" in cells


@pytest.mark.parametrize("length", [100.0, 1500.0])
def test_a_picture_has_the_points_of_each_kind_in_their_places(length):
    rng = np.random.default_rng(1)
    box = np.array([length, 20.0, 30.0])
    parts = [rng.uniform(0, 1, (n, 3)) * box - (0, 10, -500) for n in (400, 0, 50, 900, 1)]
    picture = SpanPicture.of(span(1, length=length), parts, 22.0, 100_000)
    assert dict(zip(PICTURED, picture.counts, strict=True))["vegetation"] == 0
    assert picture.counts == (400, 0, 50, 900, 1)
    along, low = picture.origin
    restored = picture.steps * picture.step + (along, 0.0, low)
    np.testing.assert_allclose(restored, np.concatenate(parts), atol=picture.step)
    assert picture.step < 0.05


def test_a_picture_has_no_more_points_than_it_may():
    rng = np.random.default_rng(1)
    parts = [rng.uniform(0, 100, (5000, 3)) for _ in PICTURED]
    picture = SpanPicture.of(span(1), parts, 22.0, 1000)
    assert 500 < len(picture.steps) == sum(picture.counts) <= 1000
    assert min(picture.counts) > 50
