"""Towers found with voxels and measured in points."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection.conductors import ConductorPoints
from scenenet.detection.detected_voxels import DetectedVoxels
from scenenet.detection.find import _Measurement, find_towers
from scenenet.detection.rough import RoughTower
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.surroundings import surroundings_in

TAU, SIZE = 0.5, 1.0


def find(xyz, feet, *, phase=(0.0, 0.0, 0.0), probability=0.9, height=15.0, bent=True, **changes):
    """The towers when the voxels above each of ``feet`` are detected."""
    steps = np.unique(np.floor((xyz - phase) / SIZE), axis=0)
    occupied = (steps + 0.5) * SIZE + phase
    detected = np.zeros(len(occupied), bool)
    for foot in feet:
        near = np.hypot(*(occupied[:, :2] - foot[:2]).T) <= 0.9
        level = occupied[:, 2] - foot[2]
        detected |= near & (level > 3) & (level < height)
    centres = occupied[detected]
    return find_towers(
        DetectedVoxels(centres, np.full(len(centres), probability), SIZE),
        surroundings_in(occupied),
        surroundings_in(xyz),
        TAU,
        DetectionSettings(**changes),
        bent=bent,
    )


def test_a_tower_is_found_with_its_own_points(tower_scene):
    scene = tower_scene("tubular", 18.0)
    (tower,) = find(scene.xyz, [scene.foot])
    assert np.hypot(tower.x - scene.foot[0], tower.y - scene.foot[1]) < 0.15
    assert tower.base == pytest.approx(scene.foot[2], abs=0.2)
    assert tower.height == pytest.approx(18.0, abs=0.3)
    assert sorted(round(span.bearing) for span in tower.spans) == pytest.approx([30, 210], abs=4)
    own = tower.structure.contains(scene.xyz)
    assert (own & scene.tower).sum() > 0.9 * own.sum()


@pytest.mark.parametrize("phase", [(0, 0, 0), (0.5, 0, 0), (0, 0.5, 0.5), (0.5, 0.5, 0.25)])
def test_the_borders_of_the_voxels_do_not_matter(tower_scene, phase):
    scene = tower_scene("lattice_pole", 17.0)
    (here,) = find(scene.xyz, [scene.foot])
    (there,) = find(scene.xyz, [scene.foot], phase=phase)
    assert (there.x, there.y) == pytest.approx((here.x, here.y), abs=0.1)
    assert (there.base, there.height) == pytest.approx((here.base, here.height), abs=0.15)


def test_a_pole_without_conductors_is_no_tower_unless_that_is_allowed(tower_scene):
    scene = tower_scene("tubular", 18.0, bearings=())
    assert find(scene.xyz, [scene.foot]) == []
    assert len(find(scene.xyz, [scene.foot], min_conductor=0.0)) == 1


def test_a_mast_with_a_boom_that_ends_in_the_air_is_no_tower(tower_scene):
    scene = tower_scene("tubular", 18.0, bearings=())
    s = np.arange(0, 20, 0.05)
    boom = scene.foot + np.column_stack([s, np.zeros(len(s)), np.full(len(s), 17.5)])
    assert find(np.concatenate([scene.xyz, boom]), [scene.foot]) == []


def test_a_thick_branch_beside_the_head_is_no_conductor(tower_scene):
    scene = tower_scene("tubular", 18.0)
    rng = np.random.default_rng(3)
    s = rng.uniform(2.5, 28, 4000)
    turn, away = rng.uniform(0, 2 * np.pi, 4000), 0.8 * np.sqrt(rng.uniform(0, 1, 4000))
    heading = np.array([np.sin(np.radians(120)), np.cos(np.radians(120))])
    across = np.array([heading[1], -heading[0]])
    planar = s[:, None] * heading + (away * np.cos(turn))[:, None] * across
    branch = scene.foot + np.column_stack([planar, 16.5 + away * np.sin(turn)])
    (tower,) = find(np.concatenate([scene.xyz, branch]), [scene.foot])
    assert sorted(round(span.bearing) for span in tower.spans) == pytest.approx([30, 210], abs=4)


def test_two_towers_six_metres_apart_are_two(tower_scene):
    one = tower_scene("tubular", 22.0, bearing=0.0)
    other = tower_scene("tubular", 22.0, bearing=0.0, ground=False, seed=1,
                        foot=(one.foot[0] + 6.4, one.foot[1], one.foot[2]))  # fmt: skip
    towers = find(np.concatenate([one.xyz, other.xyz]), [one.foot, other.foot], height=20.0)
    assert len(towers) == 2
    places = sorted((tower.x, tower.y) for tower in towers)
    assert places[0] == pytest.approx(one.foot[:2], abs=0.3)
    assert places[1] == pytest.approx(other.foot[:2], abs=0.3)


@pytest.mark.parametrize("apart", [4.5, 5.5, 6.4])
def test_the_middle_between_two_poles_does_not_hide_them(tower_scene, apart):
    """Seen from either pole, the other may be a leg of a tower whose axis is between them."""
    one, other = pair(tower_scene, apart, 22.0, density=3.0)
    towers = find(np.concatenate([one.xyz, other.xyz]), [one.foot, other.foot], height=20.0)
    places = sorted((tower.x, tower.y) for tower in towers)
    assert len(places) == 2
    assert places[0] == pytest.approx(one.foot[:2], abs=0.3)
    assert places[1] == pytest.approx(other.foot[:2], abs=0.3)


@pytest.mark.parametrize(("kind", "pole", "towers"), [
    ("lattice", False, 1), ("lattice", True, 0), ("wooden", True, 1),
])  # fmt: skip
def test_what_was_looked_for_as_a_pole_is_no_wider(tower_scene, kind, pole, towers):
    """Such as the edge of a high building, which is as slim as a pole to the voxels."""
    scene = tower_scene(kind, 22.0)
    points, settings = surroundings_in(scene.xyz), DetectionSettings()
    occupied = surroundings_in(np.unique(np.floor(scene.xyz), axis=0) + 0.5)
    conductors = ConductorPoints(points, 4.5)
    measurement = _Measurement(
        occupied, points, conductors, np.zeros(3), SIZE, TAU, settings, bent=True
    )
    x, y, base = scene.foot.tolist()
    assert (
        len(measurement.towers_near(RoughTower(x, y, base, 22.0, 0.9, x, y, 5.5, pole))) == towers
    )


def pair(tower_scene, apart, height, **changes):
    """Two poles ``apart`` m across their lines, which lead to the north."""
    one = tower_scene("wooden", height, 0.0, **changes)
    foot = (one.foot[0] + apart, one.foot[1], one.foot[2])
    return one, tower_scene("wooden", height, 0.0, ground=False, seed=1, foot=foot, **changes)


@pytest.mark.parametrize("height", [18.0, 24.0])
def test_conductors_from_pole_to_pole_do_not_make_a_portal(tower_scene, height):
    one, other = pair(tower_scene, 6.0, height, circuits=2)
    t = np.arange(0, 6, 0.1)
    across = [
        one.foot + np.column_stack([t, np.zeros(len(t)), np.full(len(t), height - down)])
        for down in (0.2, 1.9, 3.5)
    ]
    xyz = np.concatenate([one.xyz, other.xyz, *across])
    assert len(find(xyz, [one.foot, other.foot], height=height - 2)) == 2


@pytest.mark.parametrize(("height", "width"), [(12.0, 3.0), (16.0, 5.0), (20.0, 6.4), (24.0, 6.0)])
@pytest.mark.parametrize("detected", [(-1,), (-1, 1)])
def test_a_portal_of_few_points_is_one_tower(tower_scene, height, width, detected):
    """Points on its beam have gaps; the conductor in the middle shows that there is one."""
    scene = tower_scene("h_frame", height, 0.0, density=3.0, width=width)
    feet = [scene.foot + np.array([side * width / 2, 0, 0]) for side in detected]
    (tower,) = find(scene.xyz, feet, height=height - 2)
    assert np.hypot(tower.x - scene.foot[0], tower.y - scene.foot[1]) < 0.3
    assert tower.structure.apart == pytest.approx(width / 2, abs=0.3)


def test_a_portal_is_one_tower(tower_scene):
    scene = tower_scene("h_frame", 18.0)
    across = 1.8 * np.array([np.sin(np.radians(120)), np.cos(np.radians(120)), 0])
    (tower,) = find(scene.xyz, [scene.foot + across, scene.foot - across])
    assert np.hypot(tower.x - scene.foot[0], tower.y - scene.foot[1]) < 0.3


def test_a_tree_under_the_conductors_is_no_tower(tower_scene):
    trees = ((2.0, 9.0, 13.0),)
    scene = tower_scene("tubular", 18.0, bearing=0.0, trees=trees)
    tree = scene.foot + np.array([2.0, 9.0, 0.0])
    towers = find(scene.xyz, [scene.foot, tree], height=12.0)
    assert len(towers) == 1


def test_a_tree_that_reaches_up_beside_the_conductors_is_no_tower(tower_scene):
    trees = ((2.2, 11.0, 17.5),)
    scene = tower_scene("tubular", 18.0, bearing=0.0, trees=trees)
    tree = scene.foot + np.array([2.2, 11.0, 0.0])
    (tower,) = find(scene.xyz, [scene.foot, tree], height=15.0)
    assert (tower.x, tower.y) == pytest.approx(scene.foot[:2], abs=0.3)


def test_below_tau_conductors_have_to_leave_in_two_directions(tower_scene):
    both = tower_scene("tubular", 18.0)
    assert len(find(both.xyz, [both.foot], probability=0.4)) == 1
    one = tower_scene("tubular", 18.0, bearings=(30.0,))
    assert find(one.xyz, [one.foot], probability=0.4, min_conductor=1.5) == []


def test_nothing_detected_is_no_tower(tower_scene):
    scene = tower_scene("tubular", 18.0)
    assert find(scene.xyz, []) == []


def under_conductors(bend):
    """A slender crown of 15 m amid three conductors that have a ``bend`` above it, m per m."""
    rng = np.random.default_rng(7)
    turn, z = rng.uniform(0, 2 * np.pi, 1500), rng.uniform(0.5, 15, 1500)
    wide = 1.5 * np.sqrt(rng.uniform(0, 1, 1500))
    parts = [np.column_stack([wide * np.cos(turn), wide * np.sin(turn), z])]
    s = np.arange(-28, 28, 0.25)
    for t in (-2.5, 0.0, 2.5):
        height = 14.6 + s**2 / 2000 - bend / 2 * np.abs(s)
        parts.append(np.column_stack([np.full(len(s), t), s, height]))
    ground = rng.uniform(-28, 28, (20_000, 2))
    ground = ground[np.hypot(*ground.T) <= 28]
    parts.append(np.column_stack([ground, np.zeros(len(ground))]))
    xyz = np.concatenate(parts)
    return xyz + 0.02 * rng.standard_normal(xyz.shape) + FOOT


FOOT = np.array([1000.3, 2000.7, 50.0])


def test_a_tree_that_conductors_pass_without_a_bend_is_no_tower():
    assert len(find(under_conductors(0.15), [FOOT], height=14)) == 1
    assert find(under_conductors(0.0), [FOOT], height=14) == []
    assert len(find(under_conductors(0.0), [FOOT], height=14, bent=False)) == 1


@pytest.mark.parametrize(("left", "towers"), [(-4.0, 1), (0.0, 0)])
def test_crossarms_on_both_sides_carry_conductors_that_do_not_bend(left, towers):
    """As in a dip between two hills; the branch of a tree is on one side."""
    t = np.arange(left, 4.01, 0.1)
    arms = np.column_stack([t, np.zeros(len(t)), np.full(len(t), 14.3)])
    xyz = np.concatenate([under_conductors(0.0), FOOT + arms])
    assert len(find(xyz, [FOOT], height=14)) == towers
