"""Places where points are too near a conductor."""

from __future__ import annotations

import numpy as np

from scenenet.clearance.danger import REACH_M, divided, layers, places


def hedge() -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) m of a hedge of 60 m along a wire, and their distances (n,) m from it; every
    12 m it has a higher bush."""
    x = np.arange(0.0, 60.0, 0.25)
    bush = np.abs((x + 6) % 12 - 6) < 1
    xyz = np.column_stack((x, np.zeros_like(x), np.where(bush, 2.0, 1.0)))
    return xyz, np.where(bush, 2.5, 3.5)


def test_each_stretch_of_a_hedge_is_a_place_of_its_own():
    xyz, distance = hedge()
    (whole,) = places(xyz, np.zeros(len(xyz), int))
    assert len(whole) == len(xyz)
    parts = divided(xyz, distance, few=5)
    worst = [part[np.argmin(distance[part])] for part in parts]
    bushes = np.abs(xyz[worst, 0][:, None] - np.arange(0, 60, 12)).min(axis=0)
    assert bushes.max() <= 1
    for part, nearest in zip(parts, worst, strict=True):
        assert np.abs(xyz[part, 0] - xyz[nearest, 0]).max() < REACH_M + 2
    rows = np.sort(np.concatenate(parts))
    np.testing.assert_array_equal(rows, np.arange(len(xyz)))
    assert distance[worst[0]] == distance.min()


def test_a_twig_beyond_a_tree_is_no_place_and_a_single_point_is_one():
    tree = np.array([(x, y, 0.0) for x in np.arange(-4, 4, 0.5) for y in (0.0, 1.0)])
    twig = np.array([(REACH_M + 1.0, 0.0, 0.0)])
    xyz = np.concatenate((tree, twig))
    distance = 1.0 + np.hypot(xyz[:, 0], xyz[:, 1])
    (part,) = divided(xyz, distance, few=5)
    assert len(part) == len(xyz)
    (part,) = divided(twig, np.array([1.0]), few=5)
    assert len(part) == 1


def test_low_growth_and_what_stands_above_it_are_layers_if_both_have_enough_points():
    low = np.array([True] * 6 + [False] * 8)
    above, below = layers(low, few=5)
    assert not low[above].any() and low[below].all()
    assert len(above) + len(below) == len(low)
    (together,) = layers(low[2:], few=5)
    assert len(together) == len(low) - 2
