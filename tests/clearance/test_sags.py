"""Clearances at another temperature: another catenary parameter between the same attachments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fixtures.true_line import true_line
from scipy.spatial import cKDTree

from scenenet.clearance.find_clearances import find_clearances
from scenenet.clearance.sags import read_sags, with_sags
from scenenet.clearance.section import SectionPoints
from scenenet.clearance.settings import ClearanceSettings, SpanSag
from scenenet.core.errors import InputError
from scenenet.line.records import AS_FLOWN
from scenenet.synthetic.codes import TOWER, TREE
from scenenet.synthetic.corridor import make_corridor
from scenenet.synthetic.settings import SyntheticSettings


@pytest.fixture(scope="module")
def corridor():
    """Points (n, 3) m without those of towers, their true codes, and the line."""
    settings = SyntheticSettings(
        towers=3, seed=7, kinds={"lattice_pole": 1.0}, density=8, section=0, margin=20.0
    )
    made = make_corridor(settings)
    parts = list(made)
    xyz = np.concatenate([part.xyz for part in parts])
    codes = np.concatenate([part.truth for part in parts])
    kept = codes != TOWER
    return xyz[kept], codes[kept], true_line(made.conductors)


def measured(corridor, sags):
    xyz, codes, line = corridor

    def points(area):
        inside = area.has(xyz)
        return SectionPoints(xyz[inside], codes[inside])

    return find_clearances(line, points, ClearanceSettings(sags=sags))


def test_clearances_are_those_of_the_lower_wires(corridor):
    first = max(corridor[2].spans, key=lambda span: span.length).span_id
    c = min(w.catenary.parameter for w in corridor[2].conductors if w.span_id == first)
    sags = (SpanSag(span=first, c=0.7 * c, temperature=80, source="stringing.csv"),)
    flown, hot = measured(corridor, ()), measured(corridor, sags)
    for row, before in zip(*(sorted(f.spans, key=lambda r: r.order) for f in (hot, flown)),
                           strict=True):  # fmt: skip
        if row.span_id == first:
            assert row.ground < before.ground - 0.3
            assert row.positions.startswith("modelled at 80 degrees C: catenary parameter of str")
        else:
            assert row == before and row.positions == AS_FLOWN
    assert hot.counts()["positions"] == sorted({AS_FLOWN, hot.spans[0].positions} | {
        row.positions for row in hot.spans})  # fmt: skip
    wires = [w for w in with_sags(corridor[2], sags).conductors if w.span_id == first]
    curves = [wire.catenary.at(np.arange(0, wire.catenary.length, 0.05)) for wire in wires]
    [place, *_] = sorted(
        (p for p in hot.places if p.span_id == first and p.kind == "ground"),
        key=lambda place: place.distance,
    )
    nearest = cKDTree(np.concatenate(curves)).query((place.x, place.y, place.z))[0]
    assert place.distance == pytest.approx(nearest, abs=0.01)
    assert place.positions != AS_FLOWN


def test_what_touches_a_modelled_wire_is_found_and_the_wire_as_flown_is_no_obstacle(corridor):
    xyz, codes, line = corridor
    span = max(line.spans, key=lambda span: span.length).span_id
    c = min(w.catenary.parameter for w in line.conductors if w.span_id == span)
    sags = (SpanSag(span=span, c=0.5 * c),)
    low = min(
        (w.catenary for w in with_sags(line, sags).conductors if w.span_id == span),
        key=lambda curve: curve.height(np.array([curve.length / 2]))[0],
    )
    crown = low.at(np.linspace(0.45, 0.55, 400) * low.length)
    crown += np.random.default_rng(0).normal(0, 0.05, crown.shape)
    full = np.concatenate((xyz, crown)), np.append(codes, np.full(400, TREE)), line
    [row] = [row for row in measured(full, sags).spans if row.span_id == span]
    assert row.vegetation < 0.02
    flown = measured(full, ())
    for found in (flown, measured(corridor, sags)):
        for place in found.places:
            at = np.array([(place.x, place.y, place.z)])
            apart = [np.hypot(*wire.catenary.residuals(at))[0] for wire in line.conductors]
            assert min(apart) > 0.2 or place.kind == "wire"


def test_attachments_stay_and_earth_wires_are_as_flown_unless_named(corridor):
    line = corridor[2]
    span = line.spans[0].span_id
    own = [wire for wire in line.conductors if wire.span_id == span]
    earth = replace(own[0], kind="earth wire")
    line = replace(line, conductors=(earth, *own[1:]))
    still, *lower = with_sags(line, [SpanSag(span=span, c=500)]).conductors
    assert still == earth
    for wire, before in zip(lower, own[1:], strict=True):
        assert (wire.catenary.start, wire.catenary.end) == (
            before.catenary.start, before.catenary.end)  # fmt: skip
        assert wire.c == wire.catenary.parameter == 500 and wire.sag == wire.catenary.sag
    number = earth.conductor_id
    named = with_sags(
        line, [SpanSag(span=span, c=500), SpanSag(span=span, conductor=number, c=700)]
    )
    assert [wire.c for wire in named.conductors] == [700, *[500] * len(lower)]


def test_a_parameter_that_lets_a_wire_lie_on_the_ground_is_refused(corridor):
    span = corridor[2].spans[0].span_id
    with pytest.raises(InputError, match="sag by more than half"):
        with_sags(corridor[2], [SpanSag(span=span, c=1.0)])


def test_spans_that_the_survey_does_not_have_are_named(corridor, capsys):
    found = measured(corridor, (SpanSag(span=987, c=900),))
    assert (
        "spans in the table of sags of which no conductor was found here: 987"
        in capsys.readouterr().err
    )
    assert {row.positions for row in found.spans} == {AS_FLOWN}


def test_a_table_is_read(tmp_path):
    path = tmp_path / "hot.csv"
    path.write_text("span,c,temperature\n7,900,80\n8,850.5,\n", encoding="utf-8-sig")
    assert read_sags(path) == (
        SpanSag(span=7, c=900, temperature=80, source="hot.csv"),
        SpanSag(span=8, c=850.5, source="hot.csv"),
    )


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("span,temperature\n7,80\n", "has no column c"),
        ("span,c,tension\n7,900,1\n", "unknown column 'tension'"),
        ("span,c\n7,-900\n", "line 2: c"),
        ("span,c\nfirst,900\n", "line 2: span"),
        ("span,c\n7,900\n7,800\n", "line 3: span 7 is there twice"),
        ("span,c\n", "has no row"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused(tmp_path, text, problem):
    path = tmp_path / "hot.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=problem) as refused:
        read_sags(path)
    assert str(path) in str(refused.value)
