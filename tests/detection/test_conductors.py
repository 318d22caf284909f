"""Conductors are distinguished from treetops, roofs and booms, in voxels placed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection.conductor_rules import FAR, NEAR
from scenenet.detection.conductors import leaving_spans

HEIGHT = 15.0


def spans(lattice, *parts, height=HEIGHT, crossarm=4.0, x=0.5, y=0.5):
    """Spans that leave a pole of ``HEIGHT`` m on flat ground with ``parts`` around it."""
    everything = lattice.together(lattice.column(0, 0, 0, height), *parts)
    axis = (lattice.place[0] + x, lattice.place[1] + y)
    return leaving_spans(everything, axis, lattice.place[2], height, crossarm, 1.0)


def test_a_lone_pole_has_no_conductors(lattice):
    assert spans(lattice, lattice.ground()) == []


@pytest.mark.parametrize("bearing", [0, 30, 45, 110, 250, 355])
def test_conductors_are_found_in_their_direction(lattice, bearing):
    [span] = spans(lattice, lattice.ground(), lattice.conductors(bearing, HEIGHT))
    assert abs((span.bearing - bearing + 180) % 360 - 180) < 5
    assert span.length >= 0.9 * (FAR - NEAR)
    assert span.followed >= 0.9


@pytest.mark.parametrize("beside", [(0.0,), (-1.5, 0.0, 1.5), (-2.5, 0.0, 2.5), (-3.0, 3.0)])
def test_any_number_of_conductors_at_any_distance_is_found(lattice, beside):
    line = [lattice.conductors(b, HEIGHT, beside=beside) for b in (60, 240)]
    found = spans(lattice, lattice.ground(), *line)
    assert sorted(round(s.bearing / 10) * 10 for s in found) == [60, 240]


def test_a_line_that_turns_leaves_in_two_directions(lattice):
    line = [lattice.conductors(b, HEIGHT) for b in (10, 100)]
    assert len(spans(lattice, lattice.ground(), *line)) == 2


def test_conductors_above_one_another_are_one_direction(lattice):
    line = [lattice.conductors(60, z, beside=(2.0,)) for z in (20.0, 25.0, 29.0)]
    [span] = spans(lattice, lattice.ground(), *line, height=30.0, crossarm=7.0)
    assert span.bearing == pytest.approx(60, abs=5)


def test_conductors_with_clearance_above_a_wood_are_found(lattice):
    wood = [lattice.tree(x, y, 10.0, seed=x + 18) for x in range(-18, 19, 6) for y in (-6, 0, 6)]
    found = spans(lattice, lattice.ground(), lattice.conductors(90, HEIGHT), *wood)
    assert [round(s.bearing, -1) for s in found] == [90]


def test_conductors_are_followed_to_the_edge_of_the_data(lattice):
    inside = lattice.together(lattice.ground(), lattice.conductors(90, HEIGHT))
    seen = inside[np.hypot(*(inside - lattice.place)[:, :2].T) < 13]
    [span] = spans(lattice, seen)
    assert span.length < 11
    assert span.followed > 0.8


def test_conductors_of_a_line_that_passes_by_do_not_count(lattice):
    passing = [lattice.conductors(b, HEIGHT, y=9.0) for b in (90, 270)]
    assert spans(lattice, lattice.ground(), *passing) == []


def test_conductors_far_below_the_head_do_not_count(lattice):
    assert spans(lattice, lattice.ground(), lattice.conductors(90, 0.4 * HEIGHT)) == []


@pytest.mark.parametrize("seed", range(5))
def test_a_wood_has_no_conductors(lattice, seed):
    rng = np.random.default_rng(seed)
    wood = [
        lattice.tree(x + rng.uniform(-2, 2), y + rng.uniform(-2, 2), rng.uniform(10, 20), seed=k)
        for k, (x, y) in enumerate((x, y) for x in range(-24, 25, 6) for y in range(-24, 25, 6))
    ]
    found = spans(lattice, lattice.ground(), *wood)
    assert sum(span.followed for span in found) < 0.75


def test_a_flat_roof_has_no_conductors(lattice):
    x, y = (side.ravel() for side in np.meshgrid(np.arange(1, 25), np.arange(-12, 12)))
    roof = lattice.voxels(np.column_stack([x, y, np.full(len(x), HEIGHT - 1)]))
    assert spans(lattice, lattice.ground(), roof) == []


def test_a_facade_has_no_conductors(lattice):
    x = np.tile(np.arange(-20, 20), 10)
    floors = np.repeat(np.arange(10) * 4.0, 40)
    facade = lattice.voxels(np.column_stack([x, np.zeros(len(x)), floors]))
    assert spans(lattice, lattice.ground(), facade, height=40.0) == []


def test_a_boom_that_rises_steeply_is_not_a_conductor(lattice):
    s = np.arange(0, 25, 0.25)
    boom = lattice.voxels(np.column_stack([s, np.zeros(len(s)), 5 + s]))
    assert spans(lattice, lattice.ground(), boom) == []


def test_empty_surroundings_have_no_conductors(lattice):
    axis = (lattice.place[0], lattice.place[1])
    assert leaving_spans(np.empty((0, 3)), axis, 100.0, 15.0, 4.0, 1.0) == []


def test_spans_do_not_depend_on_the_order_of_the_voxels(lattice):
    scene = lattice.together(lattice.ground(), *(lattice.conductors(b, HEIGHT) for b in (75, 255)))
    mixed = scene[np.random.default_rng(0).permutation(len(scene))]
    axis = (lattice.place[0] + 0.5, lattice.place[1] + 0.5)
    one, other = (
        leaving_spans(voxels, axis, lattice.place[2], HEIGHT, 4.0, 1.0) for voxels in (scene, mixed)
    )
    assert [s.length for s in one] == [s.length for s in other]
    assert [s.bearing for s in one] == pytest.approx([s.bearing for s in other])
