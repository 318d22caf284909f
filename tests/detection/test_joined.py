"""The legs of a window tower are one tower, two towers side by side are two."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenenet.detection.conductors import Span
from scenenet.detection.distinct import distinct_towers
from scenenet.detection.ground import Ground
from scenenet.detection.head import NO_HEAD, Head
from scenenet.detection.joined import joined, tower_of
from scenenet.detection.measured_tower import MeasuredTower
from scenenet.detection.profile import Profile
from scenenet.detection.structure import Structure
from scenenet.detection.surroundings import surroundings_in

HEIGHT, WIDTH = 25.0, 1.6
NORTH = np.array([0.0, 1.0])


def body(scene, east, north=0.0, left=-5.0, right=5.0, **changes):
    """A body ``east`` and ``north`` m of the foot of a scene, under a line to the north; its
    conductors pass it from ``left`` to ``right`` m."""
    profile = Profile(0.0, 0.0, WIDTH / 2, WIDTH / 2, HEIGHT, 0.5, 0.5)
    ground = Ground(scene.foot[2], np.zeros(2))
    x, y = scene.foot[0] + east, scene.foot[1] + north
    span = Span(0.0, 17.0, 1.0, 0.0, left, right, 15.0, 25.0, np.empty((0, 3)))
    shape = Structure(x, y, ground, HEIGHT, 0.5, NORTH, profile, 1.0, NO_HEAD, (span,))
    return replace(shape, **changes)


def measured(shape):
    """The same as a tower of a survey."""
    place = shape.x, shape.y, shape.ground.elevation
    size = shape.height, shape.profile.width, shape.profile.free, 1.0
    return MeasuredTower(*place, *size, shape.spans, 0.9, np.array(place[:2]), 3.0, shape)


@pytest.fixture(scope="module")
def window(tower_scene):
    return tower_scene("window", HEIGHT, 0.0)


def test_members_lead_from_leg_to_leg_and_to_the_axis(window):
    points = surroundings_in(window.xyz)
    left, right, axis = body(window, -5.0), body(window, 5.0), body(window, 0.0)
    assert joined(left, right, points)
    assert joined(right, axis, points)


def test_two_towers_side_by_side_have_air_between_them(tower_scene):
    one = tower_scene("tubular", HEIGHT, 0.0)
    both = np.concatenate([one.xyz, one.xyz + np.array([6.0, 0.0, 0.0])])
    near, far = body(one, 0.0), body(one, 6.0)
    assert not joined(near, far, surroundings_in(both))
    assert len(distinct_towers([measured(near), measured(far)], surroundings_in(both))) == 2


def test_bodies_behind_one_another_are_not_joined(window):
    points = surroundings_in(window.xyz)
    assert not joined(body(window, -5.0), body(window, 5.0, north=3.0), points)


def test_the_tower_is_the_body_amid_the_conductors(window):
    leg, axis = body(window, 5.0, left=-8.0, right=4.0), body(window, 0.0, left=-8.0, right=8.0)
    assert tower_of([leg, axis]) is axis
    points = surroundings_in(window.xyz)
    (tower,) = distinct_towers([measured(leg), measured(axis)], points)
    assert tower.structure is axis


def test_the_body_found_amid_the_conductors_is_the_tower_whatever_a_leg_shows(window):
    """A crown beside the tower, taken for a crossarm, moves the middle of all to the leg."""
    crown = Head(np.ones((26, 2), bool), -13.0, 17.0, 0.5)
    leg = body(window, -3.0, left=-5.0, right=6.0, head=crown)
    axis = body(window, 0.0, left=-8.0, right=8.0)
    assert tower_of([leg, axis]) is leg
    axis = replace(axis, amid=True)
    assert tower_of([leg, axis]) is axis


def test_two_legs_without_a_body_between_them_are_a_portal(window):
    legs = [body(window, -4.5, left=0.0, right=9.0), body(window, 4.7, left=-9.0, right=0.0)]
    shape = tower_of(legs)
    assert (shape.x, shape.y) == pytest.approx((window.foot[0] + 0.1, window.foot[1]))
    assert shape.apart == pytest.approx(4.6)
    places = window.foot + np.array([[-4.5, 0, 15], [4.7, 0, 15], [0.1, 0, 15]])
    assert shape.contains(places).tolist() == [True, True, False]


@pytest.mark.parametrize(("north", "towers"), [(12.0, 1), (40.0, 2)])
def test_a_low_body_under_the_conductors_of_a_tower_needs_a_span(window, north, towers):
    tree = body(window, 2.0, north, height=14.0)
    points = surroundings_in(window.xyz)
    found = distinct_towers([measured(tree), measured(body(window, 0.0))], points)
    assert len(found) == towers
    assert found[0].height == HEIGHT


def test_a_tree_that_seems_to_reach_up_to_the_conductors_does_not_replace_the_tower(window):
    bushy = Profile(0.0, 0.0, 2.5, 2.5, HEIGHT, 0.34, 0.5)
    tree = body(window, 2.0, 20.0, height=HEIGHT + 0.01, profile=bushy)
    points = surroundings_in(window.xyz)
    (tower,) = distinct_towers([measured(tree), measured(body(window, 0.0))], points)
    assert tower.y == window.foot[1]


def test_a_pole_may_stand_near_a_tower(window):
    thin = Profile(0.0, 0.0, 0.2, 0.2, HEIGHT, 0.8, 0.5)
    pole = body(window, 2.0, 12.0, height=14.0, profile=thin)
    points = surroundings_in(window.xyz)
    assert len(distinct_towers([measured(pole), measured(body(window, 0.0))], points)) == 2


def test_a_leg_that_stands_freer_does_not_hide_the_tower_it_is_in(window):
    wide = Profile(0.0, 0.0, 3.5, 2.0, HEIGHT, 0.9, 0.5)
    leg = body(window, 4.0, left=-6.0, right=4.0, profile=wide)
    axis = body(window, 0.0, left=-8.0, right=8.0, profile=replace(wide, free=0.4))
    (tower,) = distinct_towers([measured(leg), measured(axis)], surroundings_in(window.xyz))
    assert tower.structure is axis


def test_a_low_body_beside_the_conductors_seen_may_stand_under_a_crossarm(window):
    head = Head(np.ones((36, 2), bool), -9.0, 17.0, 0.5)
    tree = body(window, 9.0, 12.0, height=14.0)
    points = surroundings_in(window.xyz)
    for shape, towers in ((body(window, 0.0), 2), (body(window, 0.0, head=head), 1)):
        assert len(distinct_towers([measured(tree), measured(shape)], points)) == towers
