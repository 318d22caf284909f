"""Conductors as lines in points, and what looks like one."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from scenenet.detection.conductor_blocks import ConductorBlocks
from scenenet.detection.conductor_rules import RISE
from scenenet.detection.conductors import ConductorPoints
from scenenet.detection.lines import points_on_lines
from scenenet.detection.surroundings import surroundings_in

HEIGHT = 20.0
AXIS = np.array([100.3, 200.7])


def conductor(t, h, *, spacing=0.3, bearing=90.0, rise=0.0):
    """Points (N, 3) of a conductor that passes ``t`` m to the right of the axis, ``h`` m up."""
    rng = np.random.default_rng([round(10 * h), round(10 * t) + 1000])
    s = np.arange(0.5, 30, spacing)
    u = np.array([np.sin(np.radians(bearing)), np.cos(np.radians(bearing))])
    right = np.array([u[1], -u[0]])
    places = np.column_stack([s[:, None] * u + t * right + AXIS, h + rise * s])
    return places + rng.normal(0, 0.03, places.shape)


def crown(x, y, radius, top, n, seed=1):
    """Points (N, 3) in an ellipsoid ``x``, ``y`` m from the axis."""
    rng = np.random.default_rng(seed)
    ball = rng.normal(size=(n, 3))
    ball *= (rng.uniform(0, 1, n) ** (1 / 3) / np.linalg.norm(ball, axis=1))[:, None]
    return ball * [radius, radius, radius * 1.5] + np.array(
        [AXIS[0] + x, AXIS[1] + y, top - 1.5 * radius]
    )


def ground(n=3000, seed=2):
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(-32, 32, (n, 2)) + AXIS, rng.normal(0, 0.03, n)])


def spans(*parts, crossarm=5.0, height=HEIGHT):
    points = np.concatenate([ground(), *parts])
    around = surroundings_in(points)
    return ConductorPoints(around, 4.5).leaving(AXIS, 0.0, height, crossarm, around)


@pytest.mark.parametrize(("slope", "found"), [(0.9, [(270, -0.8), (90, 0.8)]), (0.0, [])])
def test_conductors_are_as_steep_as_the_ground_and_guys_are_steeper(slope, found):
    hill = ground(20_000)
    hill[:, 2] += slope * (hill[:, 0] - AXIS[0])
    line = [
        conductor(t, 17, bearing=b, rise=r) for t in (-1, 1) for b, r in ((90, 0.8), (270, -0.8))
    ]
    points = np.concatenate([hill, *line])
    around = surroundings_in(points)
    seen = ConductorPoints(around, 4.5).leaving(AXIS, 0.0, HEIGHT, 5.0, around)
    assert [(round(span.bearing), round(span.slope, 1)) for span in seen] == found
    assert [span.followed for span in seen] == [1.0] * len(found)


def test_a_house_is_not_steep_ground():
    roof = ground(20_000)
    roof[:, 2] += np.where(roof[:, 0] > AXIS[0], 20.0, 0.0)
    line = [conductor(t, 17, bearing=270, rise=0.8) for t in (-1, 1)]
    around = surroundings_in(np.concatenate([roof, *line]))
    assert ConductorPoints(around, 4.5).leaving(AXIS, 0.0, HEIGHT, 5.0, around) == []


def test_a_few_points_of_a_crown_at_the_edge_of_a_survey_are_not_steep_ground():
    crown_there = np.random.default_rng(3).uniform((130, 205, 0), (136, 211, 0), (200, 3))
    crown_there[:, 2] = 4 * (crown_there[:, 0] - 130)
    blocks = ConductorBlocks(surroundings_in(crown_there), 4.5)
    assert blocks.near(np.array([131.0, 208.0]), 2.0).rise == RISE


@pytest.mark.parametrize("spacing", [0.05, 0.3, 1.2, 2.0])
def test_a_conductor_is_found_at_any_density(spacing):
    (span,) = spans(conductor(1.5, 17, spacing=spacing))
    assert span.bearing == pytest.approx(90, abs=2)
    assert span.followed > 0.85
    assert (span.left, span.highest) == pytest.approx((1.5, 17), abs=0.4)


def test_conductors_three_metres_above_one_another_are_found():
    (span,) = spans(*(conductor(1.5, h) for h in (13, 16, 19)))
    assert span.followed == 1
    assert (span.lowest, span.highest) == pytest.approx((13, 19), abs=0.3)


def test_a_bundle_is_a_conductor():
    bundle = [conductor(2 + dt, 18 + dh) for dt in (-0.2, 0.2) for dh in (-0.2, 0.2)]
    (span,) = spans(*bundle)
    assert span.followed == 1


def test_a_conductor_close_above_a_tree_is_found():
    (span,) = spans(conductor(1.5, 17), crown(10, 1.5, 3, 16, 3000))
    assert span.followed == 1


def test_conductors_on_both_sides_leave_in_two_directions():
    found = spans(conductor(1.5, 17), conductor(-1.5, 17, bearing=250.0))
    assert sorted(round(span.bearing) for span in found) == pytest.approx([90, 250], abs=2)


@pytest.mark.parametrize("n", [60, 600, 6000])
@pytest.mark.parametrize("seed", range(3))
def test_crowns_have_no_conductors(n, seed):
    rng = np.random.default_rng(seed)
    crowns = [
        crown(*rng.uniform(-20, 20, 2), rng.uniform(2, 4), rng.uniform(14, 22), n, seed + k)
        for k in range(12)
    ]
    assert spans(*crowns) == []


def test_the_rows_of_a_facade_are_no_conductors():
    rows = [conductor(2.0, h) for h in np.arange(1, 32, 3.0)]
    assert spans(*rows, height=30) == []


def test_a_roof_of_few_points_has_no_conductors():
    rng = np.random.default_rng(4)
    roof = np.column_stack([rng.uniform(-15, 15, (2500, 2)) + AXIS, np.full(2500, 15.0)])
    assert spans(roof + rng.normal(0, 0.03, roof.shape)) == []


def test_a_boom_that_rises_steeply_is_no_conductor():
    assert spans(conductor(0, 12, rise=1.0)) == []


def test_a_conductor_that_passes_far_away_does_not_leave():
    assert spans(conductor(9.0, 17)) == []


def test_the_place_of_the_blocks_hardly_matters():
    parts = [conductor(t, 17, bearing=40.0) for t in (-2.0, 0.0, 2.0)]
    here = spans(*parts)
    away = np.array([13.7, 21.3, 0.0])
    around = surroundings_in(np.concatenate([ground(), *parts]) + away)
    found = ConductorPoints(around, 4.5)
    there = found.leaving(AXIS + away[:2], 0.0, HEIGHT, 5.0, around)
    assert [round(s.bearing) for s in here] == [round(s.bearing) for s in there]
    assert [s.followed for s in here] == pytest.approx([s.followed for s in there], abs=0.15)


def test_points_on_a_line_get_its_direction():
    points = np.concatenate([conductor(0, 17, bearing=30.0), crown(8, -8, 3, 18, 2000)])
    rows, direction = points_on_lines(points, np.arange(len(points)))
    along = np.abs(direction @ [np.sin(np.radians(30)), np.cos(np.radians(30)), 0])
    n = (rows < len(conductor(0, 17))).sum()
    assert n >= 0.95 * len(conductor(0, 17))
    assert along[rows < n].min() > 0.99
    assert len(rows) - n <= 20


@pytest.mark.parametrize("z", [1e9, -1e9])
def test_a_stray_point_far_above_or_below_takes_no_memory(z):
    (span,) = spans(conductor(1.5, 17), np.array([[*AXIS, z]]))
    assert span.followed == 1


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="there is one processor")
def test_the_number_of_threads_does_not_matter():
    points = np.concatenate([conductor(0, 17, bearing=30.0), crown(8, -8, 3, 18, 2000)])
    threads, found = numba.get_num_threads(), []
    try:
        for number in (1, 2):
            numba.set_num_threads(number)
            found.append(points_on_lines(points, np.arange(len(points))))
    finally:
        numba.set_num_threads(threads)
    for one, two in zip(*found, strict=True):
        np.testing.assert_array_equal(one, two)


def test_without_points_there_is_no_line():
    rows, direction = points_on_lines(np.empty((0, 3)), np.empty(0, np.int64))
    assert len(rows) == 0
    assert direction.shape == (0, 3)
