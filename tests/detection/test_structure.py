"""Which points are a tower's own, on towers with known points."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from scenenet.detection.conductor_rules import WIDE
from scenenet.detection.conductors import ConductorPoints, Span
from scenenet.detection.measure_structure import measure_structure
from scenenet.detection.structure import BodyTests
from scenenet.detection.structure_record import from_record, to_record
from scenenet.detection.surroundings import surroundings_in

ANY = BodyTests(9.0, 0.75, 1 / 3)


def measured(scene, height, away=(0.8, -0.7), tests=ANY, amid=False):
    axis = scene.foot[:2] + away
    near = np.hypot(*(scene.xyz[:, :2] - axis).T) <= 28
    crossarm, base = max(3.0, 0.25 * (WIDE if amid else 1) * height), scene.foot[2]
    around = surroundings_in(scene.xyz)
    conductors = ConductorPoints(around, 4.5)

    def leaving(*where):
        return conductors.leaving(*where, around=around)

    return measure_structure(scene.xyz[near], leaving, axis, base, height, crossarm, tests, amid)


def points_score(shape, scene):
    own = shape.contains(scene.xyz)
    return (own & scene.tower).sum() / own.sum(), (own & scene.tower).sum() / scene.tower.sum()


@pytest.mark.parametrize(
    ("kind", "height"),
    [("tubular", 18.0), ("wooden", 15.0), ("lattice_pole", 17.0), ("h_frame", 18.0),
     ("lattice", 40.0)],
)  # fmt: skip
def test_its_own_points_are_found_and_few_others(tower_scene, kind, height):
    scene = tower_scene(kind, height)
    shape = measured(scene, height + 2)
    precision, recall = points_score(shape, scene)
    assert precision > 0.9
    assert recall > 0.8
    assert np.hypot(shape.x - scene.foot[0], shape.y - scene.foot[1]) < 0.3
    assert shape.height == pytest.approx(height, abs=0.4)
    assert shape.ground.elevation == pytest.approx(scene.foot[2], abs=0.3)


@pytest.mark.parametrize(
    ("kind", "height"), [("tubular", 18.0), ("h_frame", 18.0), ("lattice", 40)]
)
def test_its_record_says_the_same_of_every_point(tower_scene, kind, height):
    scene = tower_scene(kind, height)
    shape = measured(scene, height + 2)
    again = from_record(json.loads(json.dumps(to_record(shape))))
    np.testing.assert_array_equal(again.contains(scene.xyz), shape.contains(scene.xyz))
    assert again.reach == shape.reach
    assert to_record(again) == to_record(shape)


@pytest.mark.parametrize(("kind", "height"), [("lattice", 35.0), ("h_frame", 18.0)])
def test_its_height_counts_from_the_ground_at_the_axis_where_a_slope_falls_below_the_crossarms(
    tower_scene, kind, height
):
    scene = tower_scene(kind, height, bearing=0.0, slope=0.4)
    shape = measured(scene, height + 2)
    precision, recall = points_score(shape, scene)
    assert shape.height == pytest.approx(height, abs=0.4)
    assert precision > 0.9
    assert recall > 0.8


@pytest.mark.parametrize("bearing", [0, 17, 45, 90, 133])
def test_the_direction_of_the_line_does_not_matter(tower_scene, bearing):
    scene = tower_scene("lattice", 35.0, bearing)
    precision, recall = points_score(measured(scene, 36), scene)
    assert precision > 0.9
    assert recall > 0.85


@pytest.mark.parametrize("away", [(0, 0), (1.5, 0), (0, -1.5), (-1.2, 1.2)])
def test_the_approximate_axis_does_not_matter(tower_scene, away):
    scene = tower_scene("tubular", 18.0)
    one, other = measured(scene, 20, (0.1, 0.1)), measured(scene, 20, away)
    assert (one.x, one.y) == pytest.approx((other.x, other.y), abs=0.1)
    assert one.height == pytest.approx(other.height, abs=0.1)


def test_crowns_beside_the_body_and_under_the_conductors_are_not_its_own(tower_scene):
    trees = ((3.4, 0.5, 12.0), (-3.3, 1.5, 13.0), (0.0, -3.6, 9.0), (2.6, 7.0, 14.0))
    scene = tower_scene("tubular", 18.0, trees=trees)
    precision, recall = points_score(measured(scene, 20), scene)
    assert precision > 0.8
    assert recall > 0.85


def test_scrub_at_the_foot_is_not_its_own(tower_scene):
    scene = tower_scene("tubular", 18.0)
    rng = np.random.default_rng(5)
    scrub = np.column_stack([rng.uniform(-4, 4, (6000, 2)), rng.uniform(0, 1.4, 6000)])
    xyz = np.concatenate([scene.xyz, scrub + scene.foot])
    codes = np.append(scene.codes, np.full(len(scrub), 4))
    overgrown = type(scene)(xyz, codes, scene.foot)
    shape = measured(overgrown, 20)
    assert shape.foot >= 1.4
    assert points_score(shape, overgrown)[0] > 0.9


def test_a_portal_is_one_tower_with_its_axis_between_the_poles(tower_scene):
    scene = tower_scene("h_frame", 18.0)
    shape = measured(scene, 20, away=(1.2, 0.9))
    assert shape.apart == pytest.approx(1.8, abs=0.15)
    assert np.hypot(shape.x - scene.foot[0], shape.y - scene.foot[1]) < 0.3


def test_two_poles_without_a_beam_are_no_portal(tower_scene):
    one = tower_scene("tubular", 18.0, bearing=0.0)
    other = tower_scene("tubular", 18.0, bearing=0.0, ground=False, seed=1,
                        foot=(one.foot[0] + 3.6, one.foot[1], one.foot[2]))  # fmt: skip
    both = type(one)(
        np.concatenate([one.xyz, other.xyz]), np.append(one.codes, other.codes), one.foot
    )
    assert measured(both, 20, away=(-0.3, 0.2)).apart == 0


@pytest.mark.parametrize("n", [2, 4])
def test_a_thinned_tower_keeps_its_axis_and_height(tower_scene, n):
    scene = tower_scene("lattice_pole", 17.0).keep_every(n)
    shape = measured(scene, 19)
    assert np.hypot(shape.x - scene.foot[0], shape.y - scene.foot[1]) < 0.4
    assert shape.height == pytest.approx(17.0, abs=0.6)


def test_a_lone_tree_may_stand_free_but_carries_nothing(tower_scene):
    scene = tower_scene("tubular", 18.0, trees=((12.0, 0.0, 15.0),))
    tree = measured(scene, 15, away=(12.0, 0.0))
    assert tree is not None
    assert not tree.carries(0.3)
    assert measured(scene, 20).carries(1.5)


def test_a_bird_above_a_tower_is_not_its_top(tower_scene):
    scene = tower_scene("tubular", 18.0)
    bird = scene.foot + np.array([[0.0, 0.1, 27.0]])
    higher = type(scene)(np.concatenate([scene.xyz, bird]), np.append(scene.codes, 7), scene.foot)
    assert measured(higher, 28).height == pytest.approx(18.0, abs=0.4)


def test_a_moved_shape_has_the_moved_points(tower_scene):
    scene = tower_scene("tubular", 18.0)
    shape = measured(scene, 20)
    there = shape.moved(100.0, -50.0, 3.0)
    moved = there.contains(scene.xyz + np.array([100.0, -50.0, 3.0]))
    assert np.array_equal(moved, shape.contains(scene.xyz))


def test_reach_covers_every_point_of_a_tower(tower_scene):
    scene = tower_scene("lattice", 40.0)
    shape = measured(scene, 42)
    own = scene.xyz[shape.contains(scene.xyz)]
    assert np.hypot(own[:, 0] - shape.x, own[:, 1] - shape.y).max() <= shape.reach


@pytest.mark.parametrize("away", [(0.0, 0.0), (1.5, 4.0), (-1.0, -3.5)])
def test_the_axis_of_a_window_tower_is_amid_its_conductors(tower_scene, away):
    """Either leg stands free over more of the height than the body below them."""
    scene = tower_scene("window", 24.0, bearing=0.0)
    shape = measured(scene, 23.0, away, amid=True)
    assert np.hypot(shape.x - scene.foot[0], shape.y - scene.foot[1]) < 0.6
    precision, recall = points_score(shape, scene)
    assert precision > 0.9
    assert recall > 0.6  # its legs end above the conductors, where nothing shows a head


def test_a_cable_below_and_conductors_above_a_tree_are_not_attached_to_it(tower_scene):
    """The cable is of another line; neither passes where a tower so high holds any."""
    shape = measured(tower_scene("tubular", 18.0), 20)
    at = {"length": 17.0, "followed": 1.0, "slope": 0.0, "places": np.empty((0, 3))}
    cable = Span(bearing=30.0, left=-1, right=1, lowest=9.5, highest=10, **at)
    above = Span(bearing=210.0, left=-1, right=1, lowest=24, highest=25, **at)
    own = Span(bearing=210.0, left=-1, right=1, lowest=9.5, highest=18, **at)
    assert not replace(shape, spans=(cable, above)).carries(0.75)
    assert replace(shape, spans=(cable, own)).carries(0.75)


@pytest.mark.parametrize("even", [True, False])
def test_the_air_in_a_window_does_not_count_against_its_tower(tower_scene, even):
    """Scrub hides much of the body below the window: it stands free at few levels of all."""
    bushes = tuple((x, y, 6.0) for x in (-4.0, 0.0, 4.0) for y in (-4.0, 0.0, 4.0))
    scene = tower_scene("window", 25.0, bearing=0.0, circuits=2, trees=bushes)
    if not even:
        arm = (scene.xyz[:, 0] > scene.foot[0] + 6.5) & scene.tower
        scene = type(scene)(scene.xyz[~arm], scene.codes[~arm], scene.foot)
    shape = measured(scene, 25.0, (0.3, 0.2), amid=True)
    assert (shape is not None) == even
    if shape is not None:
        assert shape.profile.free < ANY.free
        assert np.hypot(shape.x - scene.foot[0], shape.y - scene.foot[1]) < 0.6
