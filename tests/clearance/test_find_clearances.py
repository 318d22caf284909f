"""Clearances of a synthetic corridor, against all its points and its true catenaries."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

import numpy as np
import pytest
from fixtures.true_line import span_of, true_line, wire_of
from scipy.spatial import cKDTree

from scenenet.clearance.find_clearances import find_clearances
from scenenet.clearance.records import SurveyClearances
from scenenet.clearance.section import SectionPoints
from scenenet.clearance.settings import ClearanceSettings
from scenenet.core.errors import InputError
from scenenet.line.catenary import Catenary
from scenenet.line.records import AS_FLOWN, SurveyLine
from scenenet.pointcloud.class_schemes import EDP
from scenenet.synthetic.codes import CONDUCTOR, GRASS, SCRUB, TALL, TOWER, TREE
from scenenet.synthetic.corridor import make_corridor
from scenenet.synthetic.settings import SyntheticSettings

KV = 66.0
VEGETATION = (GRASS, SCRUB, TREE, TALL)
SETTINGS = ClearanceSettings(voltage=KV)
LIMITS = SETTINGS.applied()


@pytest.fixture(scope="module")
def corridor():
    """A line of four poles in a wood: points (n, 3) m, their true codes, and the line."""
    settings = SyntheticSettings(
        towers=4, seed=7, kinds={"lattice_pole": 1.0}, density=20, section=0, margin=30.0
    )
    made = make_corridor(settings)
    parts = list(made)
    xyz = np.concatenate([part.xyz for part in parts])
    return xyz, np.concatenate([part.truth for part in parts]), true_line(made.conductors)


def within(xyz, codes):
    """Gives points in an area, without those of towers, as a prediction does."""
    kept = codes != TOWER
    xyz, codes = xyz[kept], codes[kept]

    def points(area):
        inside = area.has(xyz)
        return SectionPoints(xyz[inside], codes[inside])

    return points


@pytest.fixture(scope="module", params=["classes", "heights"])
def found(request, corridor):
    xyz, codes, line = corridor
    scheme = EDP if request.param == "classes" else None
    return find_clearances(line, within(xyz, codes), SETTINGS, scheme)


@pytest.fixture(scope="module")
def distances(corridor):
    """Distance of every point of true vegetation from every conductor, m: (n, 3) and (n, k)."""
    xyz, codes, line = corridor
    plants = xyz[np.isin(codes, VEGETATION)]
    apart = []
    for wire in line.conductors:
        curve = wire.catenary
        samples = curve.at(np.linspace(0, curve.length, int(curve.length / 0.05)))
        apart.append(cKDTree(samples).query(plants, distance_upper_bound=25.0)[0])
    return plants, np.array(apart).T


def test_the_nearest_vegetation_is_that_of_all_points(found, corridor, distances):
    errors = []
    for number, wire in enumerate(corridor[2].conductors):
        [place] = [
            place for place in found.places
            if (place.span_id, place.conductor_id, place.kind, place.what)
            == (wire.span_id, wire.conductor_id, "vegetation", "nearest")
        ]  # fmt: skip
        errors.append(abs(place.distance - distances[1][:, number].min()))
        assert place.distance == pytest.approx(np.hypot(place.vertical, place.horizontal))
        on = wire.catenary.at(np.array([place.along]))[0]
        np.testing.assert_allclose(on, (place.wire_x, place.wire_y, place.wire_z))
        assert place.margin == pytest.approx(place.distance - LIMITS.vegetation)
    assert np.median(errors) <= 0.01
    assert np.max(errors) <= 0.1


def test_every_point_that_is_too_near_is_in_a_danger_place(found, corridor, distances):
    spans = np.array([wire.span_id for wire in corridor[2].conductors])
    in_all = 0
    for span_id in np.unique(spans):
        true = (distances[1][:, spans == span_id].min(axis=1) < LIMITS.vegetation).sum()
        own = [p for p in found.dangers if p.span_id == span_id and p.kind == "vegetation"]
        assert sum(place.points for place in own) >= true
        assert sum(place.points for place in own) <= 1.05 * true + 5
        in_all += len(own)
    assert in_all >= 5
    assert all(p.margin < 0 and p.distance < p.limit for p in found.dangers)
    assert all((p.note == "few points") == (p.points < 5) for p in found.dangers)


def test_places_of_one_span_are_apart(found):
    for _, group in groupby(sorted(found.dangers, key=lambda p: p.span_id), lambda p: p.span_id):
        places = np.array([(p.x, p.y) for p in group if p.kind == "vegetation"])
        if len(places) > 1:
            assert cKDTree(places).query(places, k=2)[0][:, 1].min() > 1.0


def test_own_points_of_a_line_are_no_obstacles(found, corridor):
    xyz, codes, _ = corridor
    wires = cKDTree(xyz[codes == CONDUCTOR])
    near = [place for place in found.places if place.distance < 3]
    assert near
    apart = wires.query([(place.x, place.y, place.z) for place in near])[0]
    assert apart.min() > 1e-3


def test_the_worst_comes_first_and_spans_say_it(found, corridor):
    margins = [place.margin for place in found.places]
    assert margins == sorted(margins)
    assert [row.worst_margin for row in found.spans] == sorted(r.worst_margin for r in found.spans)
    assert {row.span_id for row in found.spans} == {s.span_id for s in corridor[2].spans}
    first = found.spans[0]
    assert first.worst_kind == found.places[0].kind
    own = [place for place in found.dangers if place.span_id == first.span_id]
    assert (first.dangers, first.danger_points) == (len(own), sum(p.points for p in own))
    assert first.vegetation == min(
        p.distance for p in found.places if p.span_id == first.span_id and p.kind == "vegetation"
    )


def test_every_output_says_where_kinds_are_from_and_what_positions_are(found):
    for row in (*found.places, *found.trees, *found.spans, *found.profile):
        assert row.positions == AS_FLOWN
    for row in (*found.places, *found.trees, *found.spans):
        assert row.kinds == found.kinds
    assert "height above ground" in found.kinds
    assert all(row.limits.startswith("66 kV: examples") for row in found.spans)


def test_steps_along_a_span_have_the_nearest_of_each(found):
    for row in found.spans:
        own = [s for s in found.profile if s.span_id == row.span_id and s.kind == "ground"]
        assert min(step.distance for step in own) == pytest.approx(row.ground)
        starts = [step.start for step in own]
        assert starts == sorted(starts)
        assert all(start % SETTINGS.step == 0 for start in starts)
        assert all(step.wire_z - step.z <= step.distance * 1.5 for step in own)


def test_trees_that_could_fall_are_taller_than_their_way_to_the_wire(found, corridor):
    assert len(found.trees) >= 5
    curves = {(w.span_id, w.conductor_id): w.catenary for w in corridor[2].conductors}
    for tree in found.trees:
        curve = curves[tree.span_id, tree.conductor_id]
        samples = curve.at(np.linspace(0, curve.length, 2000))
        foot = np.array([tree.x, tree.y, tree.ground])
        apart = np.linalg.norm(samples - foot, axis=1).min()
        assert tree.distance == pytest.approx(apart, abs=0.05)
        assert tree.margin == pytest.approx(tree.distance - tree.height) and tree.margin < 0
        assert tree.height < 40


def test_clearances_are_read_as_they_were_written(found):
    assert SurveyClearances.from_json(found.to_json()) == found
    counts = found.counts()
    assert (counts["dangers"], counts["fall_trees"]) == (len(found.dangers), len(found.trees))


def test_without_a_voltage_distances_have_no_limits(corridor):
    xyz, codes, line = corridor
    own = tuple(wire for wire in line.conductors if wire.span_id == 2)
    one = SurveyLine(line.spans[1:2], own, ())
    free = find_clearances(one, within(xyz, codes), ClearanceSettings(), EDP)
    assert not free.dangers
    assert {place.limit for place in free.places} == {None}
    [row] = free.spans
    assert row.worst_margin is None and row.limits == ""
    assert row.worst_kind == free.places[0].kind
    distances = [place.distance for place in free.places]
    assert distances == sorted(distances)


def test_a_wire_of_another_line_is_an_obstacle_and_one_of_the_own_line_is_not():
    def straight(*ends: tuple[float, float, float]) -> Catenary:
        return Catenary(*ends, 2000.0)

    own = [straight((0, y, 30), (200, y, 30)) for y in (-4.0, 4.0)]
    below = straight((100, -80, 20), (104, 80, 20))
    cable = straight((20, -20, 12), (22, 20, 12))
    ends = [np.array([0.0, 0.0]), np.array([200.0, 0.0])]
    across = [np.array(below.start[:2]), np.array(below.end[:2])]
    line = SurveyLine(
        (
            span_of(1, 1, ends),
            span_of(2, 2, across),
            span_of(3, 0, [np.array(cable.start[:2]), np.array(cable.end[:2])]),
        ),
        (
            *(wire_of(curve, 1, n) for n, curve in enumerate(own, 1)),
            wire_of(below, 2, 1),
            wire_of(cable, 3, 1, "cable"),
        ),
        (),
    )
    level = np.random.default_rng(1).uniform((-30, -90, 0), (230, 90, 0.05), (20_000, 3))
    found = find_clearances(
        line, lambda area: SectionPoints(level[area.has(level)]), ClearanceSettings(voltage=400)
    )
    wires = [place for place in found.places if place.kind == "wire"]
    assert {(place.span_id, place.other_span) for place in wires} == {(1, 2), (1, 3), (2, 1)}
    [nearest] = [p for p in wires if (p.span_id, p.conductor_id, p.other_span) == (1, 1, 2)]
    height = [curve.height(np.array([curve.length / 2]))[0] for curve in (own[0], below)]
    assert nearest.distance == pytest.approx(height[0] - height[1], abs=0.1)
    assert nearest.what == "nearest" and nearest.margin > 0
    near = replace(line, conductors=(*line.conductors[:2], wire_of(
        straight((100, -80, 24), (104, 80, 24)), 2, 1), line.conductors[3]))  # fmt: skip
    worse = find_clearances(
        near, lambda area: SectionPoints(level[area.has(level)]), ClearanceSettings(voltage=400)
    )
    crossing = [p for p in worse.dangers if p.kind == "wire"]
    assert {(place.span_id, place.other_span) for place in crossing} == {(1, 2), (2, 1)}
    assert all(place.note == "" for place in crossing)
    rows = {row.span_id: row for row in worse.spans}
    assert set(rows) == {1, 2}  # a cable of no line is an obstacle only


@pytest.mark.parametrize(("beside", "crosses"), [(0.3, False), (7.0, True)])
def test_a_cable_that_passes_its_tower_is_an_obstacle_and_one_on_the_pole_is_not(beside, crosses):
    own = Catenary((0.0, 0.0, 16.0), (70.0, 0.0, 16.0), 900.0)
    cable = Catenary((0.0, beside, 12.0), (36.0, beside, 12.0), 250.0)
    places = [np.array([x, 0.0]) for x in (0.0, 36.0, 70.0)]
    wire, held = wire_of(own, 1, 1), wire_of(cable, 2, 1, "cable")
    line = SurveyLine(
        (
            span_of(1, 1, [places[0], places[2]], 5, 6),
            span_of(2, 0, places[:2], 5, 0),
        ),
        (replace(wire, from_tower=5, to_tower=6), replace(held, from_tower=5)),
        (),
    )
    level = np.random.default_rng(1).uniform((-30, -60, 0), (100, 60, 0.05), (10_000, 3))
    found = find_clearances(
        line, lambda area: SectionPoints(level[area.has(level)]), ClearanceSettings(voltage=66)
    )
    wires = [place.other_span for place in found.places if place.kind == "wire"]
    assert wires == ([2] if crosses else [])


def test_a_voltage_without_limits_is_refused(corridor):
    xyz, codes, line = corridor
    with pytest.raises(InputError, match="750 kV"):
        find_clearances(line, within(xyz, codes), ClearanceSettings(voltage=750), EDP)


def test_what_was_taken_for_a_conductor_is_an_obstacle_once_it_is_rejected(corridor):
    xyz, codes, line = corridor
    gone = line.conductors[0]
    others = tuple(wire for wire in line.conductors if wire is not gone)

    def points(area):
        found = within(xyz, codes)(area)
        # The model of wires is sure of all conductors.
        return replace(found, wire=found.codes == CONDUCTOR, codes=None)

    untraced = find_clearances(replace(line, conductors=others), points, SETTINGS)
    rejected = replace(line, conductors=others, rejected=(gone,))
    found = find_clearances(rejected, points, SETTINGS)
    assert (gone.span_id, gone.conductor_id) not in {
        (place.span_id, place.conductor_id) for place in found.places
    }
    own = gone.catenary

    def on_it(clearances):
        places = [p for p in clearances.dangers if p.span_id == gone.span_id]
        at = np.array([(p.x, p.y, p.z) for p in places]).reshape(-1, 3)
        return (np.hypot(*own.residuals(at)) < 0.2).sum() if len(at) else 0

    assert on_it(untraced) == 0
    assert on_it(found) > 0


def test_a_crown_beside_low_growth_that_is_nearer_is_a_place_of_its_own():
    wire = Catenary((0.0, 0.0, 4.0), (60.0, 0.0, 4.0), 1e6)
    ground = np.array([(x, y, 0.0) for x in np.arange(0, 60, 0.5) for y in np.arange(-9, 9, 0.5)])
    across = np.linspace(-0.5, 0.5, 3)
    low = np.array([(30 + x, 1.0 + y, 0.7) for x in across for y in across])
    crown = np.array([(32 + x, 3.6 + y, 2.5) for x in across for y in across])
    xyz = np.concatenate((ground, low, crown))
    span = span_of(1, 1, np.array([(0.0, 0.0), (60.0, 0.0)]))
    found = find_clearances(
        SurveyLine((span,), (wire_of(wire, 1, 1),), ()),
        lambda area: SectionPoints(xyz[area.has(xyz)]),
        SETTINGS,
    )
    plants = [place for place in found.dangers if place.kind == "vegetation"]
    assert [(place.z, place.points) for place in plants] == [(0.7, 9), (2.5, 6)]
    assert [place.x for place in plants] == pytest.approx([30, 32], abs=0.6)
