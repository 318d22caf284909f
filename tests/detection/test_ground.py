"""The ground under an axis, from points."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection.ground import fit_ground

AXIS = np.zeros(2)


def field(slope=(0.0, 0.0), n=4000, seed=0):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-12, 12, (n, 2))
    return np.column_stack([xy, 100 + xy @ np.array(slope) + 0.03 * rng.standard_normal(n)])


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.3, -0.2), (0.8, 0.4)])
def test_a_slope_is_found_with_the_elevation_at_the_axis(slope):
    ground = fit_ground(field(slope), AXIS)
    assert ground.elevation == pytest.approx(100, abs=0.1)
    assert ground.slope == pytest.approx(np.array(slope), abs=0.05)


def test_crowns_over_most_of_the_ground_do_not_raise_it():
    bare = field((0.2, 0.0))
    hidden = bare[:, 1] > -4
    rng = np.random.default_rng(1)
    crown = (
        bare[hidden]
        + [0, 0, 4]
        + np.column_stack([np.zeros((hidden.sum(), 2)), rng.uniform(0, 6, hidden.sum())])
    )
    seen = np.concatenate([bare[~hidden], bare[hidden][::6], crown])
    assert fit_ground(seen, AXIS).elevation == pytest.approx(100, abs=0.3)


def test_single_returns_from_below_do_not_lower_it():
    below = np.array([[0.5, 0.5, 70.0], [-2.0, 1.0, 80.0]])
    assert fit_ground(np.concatenate([field(), below]), AXIS).elevation == pytest.approx(
        100, abs=0.1
    )


def test_without_ground_the_lowest_points_are_the_foot(tower_scene):
    scene = tower_scene("lattice", 40.0, ground=False, density=20.0)
    above = scene.xyz[scene.xyz[:, 2] > scene.foot[2]]  # its legs are longer
    ground = fit_ground(above, scene.foot[:2])
    assert ground.elevation == pytest.approx(scene.foot[2], abs=0.7)


def test_without_ground_legs_that_stand_wide_are_the_foot(tower_scene):
    scene = tower_scene("lattice", 46.0, ground=False, density=20.0)
    above = scene.xyz[(scene.xyz[:, 2] > scene.foot[2]) & scene.tower]
    wide = (above - scene.foot) * [2.2, 2.2, 1.0] + scene.foot
    assert np.hypot(*(wide - scene.foot)[wide[:, 2] < scene.foot[2] + 1, :2].T).min() > 6.0
    ground = fit_ground(wide, scene.foot[:2])
    assert ground.elevation == pytest.approx(scene.foot[2], abs=0.7)


def test_a_ditch_beside_a_crown_that_hides_the_ground_is_not_the_foot():
    bare, rng = field(n=8000), np.random.default_rng(2)
    bare[np.abs(bare[:, 0] - 10) < 1, 2] -= 3
    hidden = np.hypot(*bare[:, :2].T) < 7
    crown = bare[hidden][::10]
    crown[:, 2] += rng.uniform(1, 9, len(crown))
    ground = fit_ground(np.concatenate([bare[~hidden], crown]), AXIS)
    assert ground.elevation == pytest.approx(101, abs=0.6)


def test_height_is_measured_along_z_from_the_slope():
    ground = fit_ground(field((0.5, 0.0)), AXIS)
    up = ground.height(np.array([4.0, 0.0]), np.zeros(2), np.array([112.0, 100.0]))
    assert up == pytest.approx([10.0, 0.0], abs=0.2)


def test_the_order_of_the_points_does_not_matter():
    points = field((0.1, 0.1))
    one, other = fit_ground(points, AXIS), fit_ground(points[::-1], AXIS)
    assert one.elevation == other.elevation
    assert np.array_equal(one.slope, other.slope)
