"""Conductors are distinguished from treetops, roofs and booms, in points placed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection.conductor_rules import FAR, NEAR
from scenenet.detection.conductors import ConductorPoints
from scenenet.detection.surroundings import surroundings_in

HEIGHT = 15.0


def spans(points, *parts, height=HEIGHT, crossarm=4.0):
    """Spans that leave a pole of ``HEIGHT`` m on flat ground with ``parts`` around it."""
    everything = points.together(points.column(0, 0, 0, height), *parts)
    return leaving(everything, points.place + np.array([0.5, 0.5, 0.0]), height, crossarm)


def leaving(everything, foot, height=HEIGHT, crossarm=4.0):
    """Spans that leave a pole at ``foot`` (3,) m among the points ``everything``."""
    around = surroundings_in(everything)
    found = ConductorPoints(around, 4.5)
    return found.leaving(foot[:2], float(foot[2]), height, crossarm, around)


def test_a_lone_pole_has_no_conductors(points):
    assert spans(points, points.ground()) == []


@pytest.mark.parametrize("bearing", [0, 30, 45, 110, 250, 355])
def test_conductors_are_found_in_their_direction(points, bearing):
    [span] = spans(points, points.ground(), points.conductors(bearing, HEIGHT))
    assert abs((span.bearing - bearing + 180) % 360 - 180) < 5
    assert span.length >= 0.9 * (FAR - NEAR)
    assert span.followed >= 0.9


@pytest.mark.parametrize("beside", [(0.0,), (-1.5, 0.0, 1.5), (-2.5, 0.0, 2.5), (-3.0, 3.0)])
def test_any_number_of_conductors_at_any_distance_is_found(points, beside):
    line = [points.conductors(b, HEIGHT, beside=beside) for b in (60, 240)]
    found = spans(points, points.ground(), *line)
    assert sorted(round(s.bearing / 10) * 10 for s in found) == [60, 240]


def test_a_line_that_turns_leaves_in_two_directions(points):
    line = [points.conductors(b, HEIGHT) for b in (10, 100)]
    assert len(spans(points, points.ground(), *line)) == 2


def test_conductors_above_one_another_are_one_direction(points):
    line = [points.conductors(60, z, beside=(2.0,)) for z in (20.0, 25.0, 29.0)]
    [span] = spans(points, points.ground(), *line, height=30.0, crossarm=7.0)
    assert span.bearing == pytest.approx(60, abs=5)


def test_conductors_with_clearance_above_a_wood_are_found(points):
    wood = [points.tree(x, y, 10.0, seed=x + 18) for x in range(-18, 19, 6) for y in (-6, 0, 6)]
    found = spans(points, points.ground(), points.conductors(90, HEIGHT), *wood)
    assert [round(s.bearing, -1) for s in found] == [90]


def test_conductors_are_followed_to_the_edge_of_the_data(points):
    inside = points.together(points.ground(), points.conductors(90, HEIGHT))
    seen = inside[np.hypot(*(inside - points.place)[:, :2].T) < 13]
    [span] = spans(points, seen)
    assert span.length < 11
    assert span.followed > 0.8


def test_conductors_of_a_line_that_passes_by_do_not_count(points):
    passing = [points.conductors(b, HEIGHT, y=9.0) for b in (90, 270)]
    assert spans(points, points.ground(), *passing) == []


def test_conductors_far_below_the_head_do_not_count(points):
    assert spans(points, points.ground(), points.conductors(90, 0.4 * HEIGHT)) == []


@pytest.mark.parametrize("seed", range(5))
def test_a_wood_has_no_conductors(points, seed):
    rng = np.random.default_rng(seed)
    wood = [
        points.tree(x + rng.uniform(-2, 2), y + rng.uniform(-2, 2), rng.uniform(10, 20), seed=k)
        for k, (x, y) in enumerate((x, y) for x in range(-24, 25, 6) for y in range(-24, 25, 6))
    ]
    found = spans(points, points.ground(), *wood)
    assert sum(span.followed for span in found) < 0.75


def test_a_flat_roof_has_no_conductors(points):
    roof = points.block(np.arange(1, 25, 0.5), np.arange(-12, 12, 0.5), [HEIGHT - 1])
    assert spans(points, points.ground(), roof) == []


def test_a_facade_has_no_conductors(points):
    facade = points.block(np.arange(-20, 20, 0.5), [0.0], np.arange(10) * 4.0)
    assert spans(points, points.ground(), facade, height=40.0) == []


def test_a_boom_that_rises_steeply_is_not_a_conductor(points):
    s = np.arange(0, 25, 0.25)
    boom = points.at(np.column_stack([s + 0.5, np.full(len(s), 0.5), 5 + s]))
    assert spans(points, points.ground(), boom) == []


def test_empty_surroundings_have_no_conductors(points):
    assert leaving(np.empty((0, 3)), points.place) == []


def test_spans_do_not_depend_on_the_order_of_the_points(points):
    scene = points.together(points.ground(), *(points.conductors(b, HEIGHT) for b in (75, 255)))
    mixed = scene[np.random.default_rng(0).permutation(len(scene))]
    foot = points.place + np.array([0.5, 0.5, 0.0])
    one, other = (leaving(around, foot) for around in (scene, mixed))
    assert [s.length for s in one] == pytest.approx([s.length for s in other], abs=1.0)
    assert [s.bearing for s in one] == pytest.approx([s.bearing for s in other], abs=1.0)
