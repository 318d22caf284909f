"""The body on an axis, measured in voxels placed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection import body
from scenenet.detection.body import centre_body, measure_body

AXIS = np.array([0.5, 0.5])


def stand(lattice, around, seen=(5.5, 14.5), at=AXIS, foot_radius=5.0):
    elevations = np.asarray(seen) + lattice.place[2]
    return measure_body(around, at + lattice.place[:2], elevations, foot_radius, 1.0)


def lattice_tower(lattice, height: float, spread: float):
    """Four legs that start ``spread`` m from the axis and meet at the top."""
    z = np.arange(1, height)
    off = spread * (1 - z / height)
    corners = [
        np.column_stack([0.5 + sx * off, 0.5 + sy * off, z]) for sx in (-1, 1) for sy in (-1, 1)
    ]
    return lattice.voxels(np.concatenate(corners))


def test_a_pole_stands_on_the_ground_and_ends_at_its_top(lattice):
    body = stand(lattice, lattice.together(lattice.ground(), lattice.column(0, 0, 0, 16)))
    assert body.base == pytest.approx(lattice.place[2])
    assert body.height == pytest.approx(16.0)  # the highest voxel, detected or not
    assert body.upright == 1.0


def test_one_return_from_below_the_ground_does_not_lower_the_foot(lattice):
    below = lattice.voxels(np.array([[1.0, 1.0, -30.0]]))
    body = stand(lattice, lattice.together(lattice.ground(), lattice.column(0, 0, 0, 16), below))
    assert body.base == pytest.approx(lattice.place[2])


def test_on_a_slope_the_foot_is_at_the_axis(lattice):
    slope = lattice.ground(slope=1.0)
    body = stand(lattice, lattice.together(slope, lattice.column(0, 0, 0, 16)))
    assert body.base == pytest.approx(lattice.place[2], abs=5.0)  # and not 30 m down the hill


def test_a_bird_above_a_tower_is_not_its_top(lattice):
    bird = lattice.voxels(np.array([[0.5, 0.5, 25.0]]))
    pole = lattice.column(0, 0, 0, 16)
    assert stand(lattice, lattice.together(lattice.ground(), pole, bird)).height == pytest.approx(
        16
    )


def test_a_stray_return_high_above_is_not_its_top(lattice):
    pole = lattice.column(0, 0, 0, 16)
    stray = lattice.voxels(np.array([[0.5, 0.5, 70.0]]))
    around = lattice.together(lattice.ground(), pole, stray)
    assert stand(lattice, around, seen=(5.5, 9.5, 14.5, 70.5)).height == pytest.approx(16)


def test_conductors_above_one_another_have_no_body(lattice):
    conductors = [lattice.column(0, 0, z, z + 1) for z in (18, 24, 30)]
    body = stand(lattice, lattice.together(lattice.ground(), *conductors), seen=(18.5, 30.5))
    assert body.upright < 0.2


def test_the_legs_of_a_lattice_tower_count(lattice):
    tower = lattice_tower(lattice, 40.0, 5.5)
    body = stand(lattice, lattice.together(lattice.ground(), tower), seen=np.arange(10.5, 39, 4))
    assert body.upright > 0.9


def test_the_centre_of_a_lattice_tower_is_found_from_its_legs(lattice):
    around = lattice.together(lattice.ground(), lattice_tower(lattice, 40.0, 4.0))
    leg = np.array([3.0, 3.0]) + lattice.place[:2]
    body = stand(lattice, around, seen=(10.5, 38.5))
    axis, free = centre_body(around, leg, body, 1.0)
    assert np.abs(axis - AXIS - lattice.place[:2]).max() < 0.6
    assert free > 0.5


def test_conductors_do_not_move_the_centre_of_a_body(lattice):
    pole = lattice.column(0, 0, 0, 16)
    conductors = [lattice.conductors(b, 13.0) for b in (70, 250)]
    around = lattice.together(lattice.ground(), pole, *conductors)
    axis, free = centre_body(around, AXIS + lattice.place[:2], stand(lattice, around), 1.0)
    assert np.abs(axis - AXIS - lattice.place[:2]).max() < 0.1
    assert 0.8 < free < 1  # not where the conductors are


def test_a_body_that_is_touched_everywhere_stays_where_it_is(lattice):
    x, y, z = (side.ravel() for side in np.meshgrid(*[np.arange(-9, 10)] * 2, np.arange(0, 16)))
    block = lattice.voxels(np.column_stack([x, y, z]))
    at = AXIS + lattice.place[:2]
    axis, free = centre_body(block, at, stand(lattice, block), 1.0)
    assert free == 0
    assert np.array_equal(axis, at)


@pytest.mark.parametrize("n", [1, 2, 7, 40, 41])
def test_medians_percentiles_and_levels_are_those_of_numpy_to_the_bit(n):
    values = np.random.default_rng(n).normal(0, 3, n)
    levels = np.rint(values)
    assert body._median(values) == np.median(values)
    assert body._percentile(values, 0.02) == np.percentile(values, 2)
    assert body._distinct(levels).tolist() == np.unique(levels.astype(int)).tolist()
    assert body._levels(values, values.min(), 0.2).tolist() == (
        np.rint((values - values.min()) / 0.2).tolist()
    )
