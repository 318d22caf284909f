"""The line of a survey: conductors from tower to tower, in order, and what contradicts them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from fixtures.line_scene import KnownLine, points_on

from scenenet.line.catenary import Catenary
from scenenet.line.find_line import find_line
from scenenet.line.notes import UNHELD, UNTRACED
from scenenet.line.records import SurveyLine
from scenenet.line.traced_spans import STEEP, LineTower
from scenenet.line.wire_points import WirePoints


def errors(line: SurveyLine, known: KnownLine) -> np.ndarray:
    """(n, 2) m, of each true conductor between towers: median distance of the nearest conductor
    found between the same towers, and the error of its sag."""
    found = []
    for true in known.inner:
        places = true.catenary.at_shares(np.linspace(0, 1, 40))
        ends = {true.from_tower, true.to_tower}
        same = [c for c in line.conductors if {c.from_tower, c.to_tower} == ends]
        apart = [(float(np.median(np.hypot(*c.catenary.residuals(places)))), c) for c in same]
        distance, best = min(apart, key=lambda pair: pair[0], default=(np.inf, None))
        sag = np.inf if best is None else abs(best.sag - true.catenary.sag)
        found.append((distance, sag))
    return np.array(found)


def held(line: SurveyLine):
    """Its spans between two towers."""
    return [span for span in line.spans if span.from_tower and span.to_tower]


@pytest.fixture(scope="module", params=["pylons", "poles"])
def known(request) -> KnownLine:
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="module")
def line(known) -> SurveyLine:
    return find_line(known.points, known.towers, known.to_its_ends)


def test_every_conductor_is_found_once_with_its_sag(line, known):
    distance, sag = errors(line, known).T
    assert distance.max() < 0.05
    assert np.median(sag) < 0.03 and sag.max() < 0.1
    assert sum(span.conductors + span.earth_wires for span in held(line)) == len(known.inner)


def test_spans_are_in_the_order_of_the_line(line, known):
    expected = list(pairwise(tower.id for tower in known.towers))
    found = [(span.from_tower, span.to_tower) for span in held(line)]
    assert found in (expected, [(b, a) for a, b in reversed(expected)])
    assert {span.line for span in line.spans} == {1}
    assert [span.order for span in line.spans] == list(range(1, len(line.spans) + 1))


def test_angles_are_those_of_the_towers(line, known):
    places = {tower.id: tower.place for tower in known.towers}
    ways = [places[span.to_tower] - places[span.from_tower] for span in held(line)]
    for span, (before, after) in zip(held(line), pairwise(ways), strict=False):
        bearings = np.degrees([np.arctan2(*before), np.arctan2(*after)])
        turn = (bearings[1] - bearings[0] + 180) % 360 - 180
        assert span.angle == pytest.approx(turn, abs=0.1)


def test_earth_wires_are_told_apart(line, known):
    n_earth = sum(conductor.is_earth_wire for conductor in known.inner)
    assert sum(span.earth_wires for span in held(line)) == n_earth


def test_wires_are_attached_where_their_towers_hold_them(line, known):
    true = np.array([end for c in known.inner for end in (c.catenary.start, c.catenary.end)])
    outer = {known.towers[0].id, known.towers[-1].id}
    for conductor in line.conductors:
        if not (conductor.from_tower and conductor.to_tower):
            continue
        curve = conductor.catenary
        for tower, end in ((conductor.from_tower, curve.start), (conductor.to_tower, curve.end)):
            # Beyond the outer towers only 30 m say where the line leads, and so how it turns.
            assert np.linalg.norm(true - end, axis=1).min() < (0.5 if tower in outer else 0.1)


def test_a_line_that_leaves_the_survey_says_so(line):
    assert line.spans[0].ends == line.spans[-1].ends == "leaves the survey"
    assert line.notes == ()


def test_a_missed_tower_is_expected_where_it_stands(pylons):
    missed = pylons.towers[2]
    towers = [tower for tower in pylons.towers if tower is not missed]
    line = find_line(pylons.points, towers, pylons.everywhere)
    expected = [note for note in line.notes if note.what == "tower expected"]
    apart = [np.hypot(note.x - missed.x, note.y - missed.y) for note in expected]
    assert min(apart) < 10.0


def test_a_span_that_was_not_traced_between_two_towers_is_listed(known):
    """The scanner, or the observer, missed all wires of one span."""
    first, last = known.towers[2:4]
    gone = [c for c in known.inner if {c.from_tower, c.to_tower} == {first.id, last.id}]
    missed = np.zeros(len(known.xyz), bool)
    for conductor in gone:
        s, _ = conductor.catenary.along(known.xyz)
        missed |= (s > 0) & (s < conductor.catenary.length)
    points = WirePoints(known.xyz[~missed], np.ones((~missed).sum(), bool))
    line = find_line(points, known.towers, known.to_its_ends)
    [gap] = line.notes
    assert (gap.what, {gap.tower, gap.to_tower}) == (UNTRACED, {first.id, last.id})
    assert (gap.x, gap.y) == pytest.approx(tuple((first.place + last.place) / 2))
    beside = [s for s in line.spans if {s.from_tower, s.to_tower} & {first.id, last.id}]
    assert [span.ends for span in beside] == [UNTRACED, UNTRACED]
    assert gap.span_id in {span.span_id for span in beside}


def test_a_last_span_that_was_not_traced_is_listed(poles):
    *_, before, last = poles.towers
    way = last.place - before.place
    there = (poles.xyz[:, :2] - before.place) @ way > 0
    points = WirePoints(poles.xyz[~there], np.ones((~there).sum(), bool))
    line = find_line(points, poles.towers, poles.to_its_ends)
    assert {n.what: {*n.towers} for n in line.notes} == {
        UNHELD: {last.id},
        UNTRACED: {before.id, last.id},
    }


def test_a_tower_beside_the_line_has_no_conductor(pylons):
    first = pylons.towers[0]
    false = LineTower(99, first.x + 60.0, first.y + 60.0, first.base, 20.0)
    line = find_line(pylons.points, [*pylons.towers, false], pylons.to_its_ends)
    assert [(n.what, n.tower) for n in line.notes] == [("tower without a conductor", 99)]


def test_a_slack_cable_at_a_tower_is_no_conductor(poles):
    tower = poles.towers[2]
    start = np.array([tower.x, tower.y, tower.base + 7.0])
    way = poles.inner[6].catenary.direction[::-1] * (-1, 1)
    cable = Catenary.of(start, start + np.append(40.0 * way, 0.0), 230.0)
    points = points_on(cable, 0.3, np.random.default_rng(1))
    xyz = np.concatenate([poles.xyz, points])
    line = find_line(WirePoints(xyz, np.ones(len(xyz), bool)), poles.towers, poles.everywhere)
    [found] = [c for c in line.conductors if c.kind == "cable"]
    assert found.c == pytest.approx(230.0, rel=0.1)
    assert {span.ends for span in line.spans if span.span_id == found.span_id} == {"cable"}
    assert found.span_id not in {note.span_id for note in line.notes}
    assert errors(line, poles)[:, 0].max() < 0.05


@pytest.mark.parametrize(("below", "kind"), [(8.0, "cable"), (1.0, "conductor")])
def test_a_short_wire_below_the_conductors_of_its_tower_is_a_cable(poles, below, kind):
    """It is too short to show that it is slack."""
    tower = poles.towers[2]
    held = [c.catenary.start[2] for c in poles.inner if c.from_tower == tower.id]
    start = np.array([tower.x, tower.y, min(held) - below])
    way = poles.inner[6].catenary.direction[::-1] * (-1, 1)
    points = points_on(
        Catenary.of(start, start + np.append(28.0 * way, 0.0), 600.0), 0.3, np.random.default_rng(1)
    )
    xyz = np.concatenate([poles.xyz, points])
    line = find_line(WirePoints(xyz, np.ones(len(xyz), bool)), poles.towers, poles.to_its_ends)
    [found] = [
        wire for wire in line.conductors
        if {wire.from_tower, wire.to_tower} == {0, tower.id}
    ]  # fmt: skip
    assert found.kind == kind


def test_a_jib_that_points_out_of_the_survey_is_no_span(poles):
    """A tower has conductors in a second direction, or leads to another tower."""
    x, y, base = poles.towers[0].x + 200.0, poles.towers[0].y + 200.0, poles.towers[0].base
    start = np.array([x + 1.0, y, base + 25.0])
    chords = [
        points_on(
            Catenary.of(start + np.array([0, t, z]), start + np.array([30.0, t, z]), 3000.0), 0.3,
            np.random.default_rng(1),
        )
        for t, z in ((-0.8, 0.0), (0.8, 0.0), (0.0, 1.3))
    ]  # fmt: skip
    xyz = np.concatenate([poles.xyz, *chords])
    points = WirePoints(xyz, np.ones(len(xyz), bool))

    def held(*bearings: float) -> int:
        crane = LineTower(99, x, y, base, 28.0, 1.7, bearings)
        line = find_line(points, [*poles.towers, crane], poles.to_its_ends)
        return sum(99 in (wire.from_tower, wire.to_tower) for wire in line.conductors)

    assert held(90.0) == 0
    assert held(90.0, 270.0) == 3


def test_points_that_are_not_certain_help_beside_those_that_are(poles):
    certain = np.ones(len(poles.xyz), bool)
    certain[np.hypot(*poles.inner[0].catenary.residuals(poles.xyz)) < 0.2] = False
    line = find_line(replace(poles.points, certain=certain), poles.towers, poles.to_its_ends)
    assert errors(line, poles)[0, 0] < 0.05


@pytest.mark.parametrize(("seen", "found"), [(3, True), (1, False)])
def test_a_line_goes_on_with_points_that_are_not_certain_if_they_show_enough_conductors(
    poles, seen, found
):
    first, last = poles.towers[2:4]
    own = [c for c in poles.inner if {c.from_tower, c.to_tower} == {first.id, last.id}]
    certain, kept = np.ones(len(poles.xyz), bool), np.ones(len(poles.xyz), bool)
    for number, conductor in enumerate(own):
        s, _ = conductor.catenary.along(poles.xyz)
        on = (s > 0) & (s < conductor.catenary.length)
        certain &= ~on
        if number >= seen:
            kept &= ~(on & (np.hypot(*conductor.catenary.residuals(poles.xyz)) < 0.2))
    points = WirePoints(poles.xyz[kept], certain[kept])
    line = find_line(points, poles.towers, poles.to_its_ends)
    between = [s for s in line.spans if {s.from_tower, s.to_tower} == {first.id, last.id}]
    assert [span.conductors for span in between] == ([len(own)] if found else [])
    assert [note.what for note in line.notes] == ([] if found else [UNTRACED])


def test_nothing_is_found_where_there_is_nothing(poles):
    empty = replace(poles.points, xyz=np.empty((0, 3)), certain=np.empty(0, bool))
    line = find_line(empty, poles.towers, poles.to_its_ends)
    assert line.spans == line.conductors == ()
    assert {note.what for note in line.notes} == {"tower without a conductor"}
    assert find_line(empty, [], poles.to_its_ends).notes == ()


def test_the_record_of_a_line_is_read_back(line):
    assert SurveyLine.from_json(line.to_json()) == line


@pytest.mark.parametrize("slope", [0.3, 0.7])
def test_conductors_of_a_steep_span_are_found_where_few_of_their_points_are_certain(slope):
    """Observers of wires answer to those that are nearly level."""
    length, rng = 70.0, np.random.default_rng(0)
    rise = slope * length
    towers = [LineTower(1, 0.0, 0.0, 100.0, 18.0), LineTower(2, length, 0.0, 100.0 + rise, 18.0)]
    wires = [Catenary((0.0, t, 116.0), (length, t, 116.0 + rise), 700.0) for t in (-1.0, 0.0, 1.0)]
    xyz = np.concatenate([points_on(wire, 0.8, rng) for wire in wires])
    certain = (xyz[:, 0] < 18.0) | (slope < STEEP)
    line = find_line(WirePoints(xyz, certain), towers, lambda place, radius: place[None])
    [span] = line.spans
    assert (span.conductors, span.from_tower, span.to_tower) == (3, 1, 2)
    middles = [c.catenary.at_shares(np.array([0.5]))[0, 2] for c in line.conductors]
    expected = [wire.at_shares(np.array([0.5]))[0, 2] for wire in wires]
    assert middles == pytest.approx(expected, abs=0.05)


def line_of(towers, wires: list[Catenary], step: float = 0.8) -> SurveyLine:
    """The line of some towers, with points every ``step`` m on these wires alone."""
    rng = np.random.default_rng(0)
    xyz = np.concatenate([points_on(wire, step, rng) for wire in wires])
    points = WirePoints(xyz, np.ones(len(xyz), bool))
    return find_line(points, towers, lambda place, radius: place[None])


def parallel(sides, length: float, z: float, parameter: float) -> list[Catenary]:
    """Level wires towards the east, each this far to the north, m."""
    return [Catenary((0.0, t, z), (length, t, z), parameter) for t in sides]


def pole(number: int, x: float, y: float = 0.0) -> LineTower:
    return LineTower(number, x, y, 100.0, 16.0, 0.4)


def test_a_line_goes_on_with_its_conductors_and_not_with_a_stray_wire():
    """A few m of a branch amid a crown are straight ahead, and the line turns there."""
    towers = [pole(1, 0.0), pole(2, 70.0), pole(3, 138.0, 17.0)]
    way = (68.0, 17.0)
    onward = [
        Catenary((70.0, t, 114.0), (70.0 + way[0], t + way[1], 114.0), 700.0)
        for t in (-1.8, 0.0, 1.8)
    ]
    stray = Catenary((70.0, 0.0, 111.0), (98.0, 0.0, 112.0), 700.0)
    wires = [*parallel((-1.8, 0.0, 1.8), 70.0, 114.0, 700.0), *onward, stray]
    line = line_of(towers, wires)
    held = [span for span in line.spans if span.from_tower and span.to_tower]
    assert [(span.from_tower, span.to_tower) for span in held] == [(1, 2), (2, 3)]
    assert len({span.line for span in held}) == 1
    assert len(line.spans) == 3


def assert_one_span(line: SurveyLine, conductors: int, idle: int | None = None):
    """All conductors lead from tower 1 to tower 2; the tower ``idle`` holds none."""
    [span] = line.spans
    assert (span.conductors, span.from_tower, span.to_tower) == (conductors, 1, 2)
    assert [(n.what, n.tower) for n in line.notes] == ([] if idle is None else [(UNHELD, idle)])


def test_a_crane_beside_the_line_takes_no_conductor_from_the_tower_behind_it():
    crane = LineTower(3, 40.0, 6.5, 100.0, 40.0, 1.8)
    wires = parallel((-1.8, 0.0, 1.8), 70.0, 114.0, 700.0)
    assert_one_span(line_of([pole(1, 0.0), pole(2, 70.0), crane], wires), 3, idle=3)


def test_a_mast_under_the_conductors_takes_none_from_the_tower_next_to_it():
    towers = [LineTower(n, x, 0.0, 100.0, 30.0, 2.0) for n, x in ((1, 0.0), (2, 300.0))]
    mast = LineTower(3, 290.0, 7.0, 100.0, 20.0, 0.8)
    wires = parallel((-8.0, -7.0, -6.0, 6.0, 7.0, 8.0), 300.0, 122.0, 1500.0)
    assert_one_span(line_of([*towers, mast], wires, step=1.0), 6, idle=3)


def test_a_tower_beside_its_conductors_holds_those_that_no_other_one_does():
    wires = parallel((-1.8, 0.0, 1.8), 70.0, 114.0, 700.0)
    assert_one_span(line_of([pole(1, 0.0), pole(2, 70.0, 4.0)], wires), 3)


def test_a_conductor_is_seen_no_further_than_its_points_reach():
    """A crown hides the last third of each conductor."""
    wires = [w.between(0.0, 80.0) for w in parallel((-1.8, 0.0, 1.8), 120.0, 114.0, 700.0)]
    line = line_of([pole(1, 0.0), pole(2, 120.0)], wires)
    assert_one_span(line, 3)
    assert [c.seen for c in line.conductors] == pytest.approx([2 / 3] * 3, abs=0.03)
    whole = line_of([pole(1, 0.0), pole(2, 120.0)], parallel((-1.8, 1.8), 120.0, 114.0, 700.0))
    assert min(c.seen for c in whole.conductors) > 0.95


def test_a_conductor_that_crowns_hide_between_its_ends_is_one():
    """The points of one of six conductors lead away from both towers, and 180 m are hidden."""
    towers = [LineTower(n, x, 0.0, 100.0, 30.0, 2.0) for n, x in ((1, 0.0), (2, 300.0))]
    wires = parallel((-8.0, -6.0, -4.0, 4.0, 6.0, 8.0), 300.0, 124.0, 1500.0)
    parts = [wires[0].between(0.0, 65.0), wires[0].between(245.0, 300.0)]
    line = line_of(towers, [*parts, *wires[1:]], step=1.0)
    assert_one_span(line, 6)
    assert sorted(c.seen for c in line.conductors) == pytest.approx([0.4] + [1.0] * 5, abs=0.05)
    assert [c.sag for c in line.conductors] == pytest.approx([wires[0].sag] * 6, abs=0.05)


def test_a_conductor_knows_the_wires_of_its_bundle_in_its_own_direction():
    """The second span was traced against the direction of its line."""
    towers = [pole(1, 0.0), pole(2, 70.0, 40.0), pole(3, 68.0, 115.0)]
    wires, offsets = [], ((0.15, 0.1), (-0.15, -0.1))
    for first, last in pairwise(towers):
        way = (last.place - first.place) / np.hypot(*(last.place - first.place))
        left = np.array([-way[1], way[0]])
        for beside, above in offsets:
            ends = [(*(tower.place + beside * left), 114.0 + above) for tower in (first, last)]
            wires.append(Catenary(*ends, 700.0))
    line = line_of(towers, wires, step=0.3)
    assert [(c.from_tower, c.to_tower) for c in line.conductors] == [(1, 2), (2, 3)]
    for conductor in line.conductors:
        assert conductor.subconductors == 2
        np.testing.assert_allclose(sorted(conductor.offsets), sorted(offsets), atol=0.03)
