"""Kinds of points and trees, on a slope with a house, trees, and returns from the air."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.clearance.kinds import (
    COLUMN_M,
    GAP,
    GAP_M,
    HOUSE,
    NO_OBSTACLE,
    ON_GROUND,
    PLANT,
    above_gap,
    surroundings,
)
from scenenet.clearance.trees import find_trees
from scenenet.pointcloud.class_schemes import ASPRS

FEW = 5

TREES = np.array([[20.0, 20.0, 14.0], [27.0, 20.0, 9.0], [60.0, 40.0, 21.0]])
"""x, y and height, m."""


def ground_at(xy: np.ndarray) -> np.ndarray:
    return 100 + 0.4 * xy[:, 0] + 2 * np.sin(xy[:, 1] / 15)


@pytest.fixture(scope="module")
def scene() -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) m and their true ``asprs`` codes."""
    rng = np.random.default_rng(5)
    ground = rng.uniform(0, 80, (30_000, 2))
    parts = [(np.column_stack((ground, ground_at(ground) + rng.normal(0, 0.03, 30_000))), 2)]
    for x, y, height in TREES:
        offset = rng.normal(0, 1, (900, 2))
        offset *= (rng.uniform(0, 1.5, 900) / np.hypot(*offset.T))[:, None]
        share = 1 - np.hypot(*offset.T) / 1.5
        z = height * (0.3 + 0.7 * share * rng.uniform(0.2, 1, 900))
        top = np.array([[x, y, ground_at(np.array([[x, y]]))[0] + height]])
        crown = np.column_stack((offset + np.array([x, y]), top[0, 2] - height + z))
        parts.append((np.concatenate((crown, top)), 5))
    roof = rng.uniform((40, 60), (52, 72), (3000, 2))
    parts.append((np.column_stack((roof, np.full(3000, 100 + 0.4 * 46 + 8.0))), 6))
    birds = np.column_stack((rng.uniform(8, 12, (25, 2)), rng.uniform(170, 180, 25)))
    parts.append((birds, 18))
    parts.append((np.column_stack((rng.uniform(30, 50, (9, 2)), rng.uniform(80, 90, 9))), 7))
    xyz = np.concatenate([points for points, _ in parts])
    return xyz, np.concatenate([np.full(len(p), code, np.uint8) for p, code in parts])


def test_classes_say_what_points_are(scene):
    xyz, codes = scene
    around = surroundings(xyz, codes, ASPRS, FEW)
    assert len(around.xyz) == np.isin(codes, (2, 5, 6)).sum()  # without noise
    kinds = {2: ON_GROUND, 5: PLANT, 6: HOUSE}
    expected = [kinds[code] for code in codes.tolist() if code in kinds]
    np.testing.assert_array_equal(around.kind, expected)
    on_ground = around.kind == ON_GROUND
    assert np.abs(around.height[on_ground]).max() < 0.5


def test_without_a_class_the_height_says_what_points_are(scene):
    xyz, codes = scene
    known, unknown = (surroundings(xyz, each, ASPRS, FEW) for each in (codes, np.ones_like(codes)))
    heights = surroundings(xyz, None, None, FEW)
    np.testing.assert_array_equal(heights.kind, unknown.kind)
    assert (heights.kind[codes == 2] == ON_GROUND).mean() > 0.99
    tall = heights.height > 1
    assert (heights.kind[np.isin(codes, (5, 6)) & tall] == PLANT).all()
    assert np.isin(codes, (5, 6))[heights.kind == PLANT].mean() > 0.99
    assert (heights.kind[np.isin(codes, (7, 18))] == NO_OBSTACLE).all()
    place = xyz[::50, :2]
    apart = heights.ground.height(place) - known.ground.height(place)
    assert np.percentile(np.abs(apart), 95) < 0.2


@pytest.mark.parametrize("scheme", [ASPRS, None])
def test_trees_are_found_one_by_one(scene, scheme):
    xyz, codes = scene
    kept = np.isin(codes, (2, 5, 7, 18))  # by height alone, a house is no other thing than a tree
    around = surroundings(xyz[kept], None if scheme is None else codes[kept], scheme, FEW)
    trees = find_trees(around, min_height=3.0)
    order = np.argsort(trees.feet[:, 0])
    assert len(order) == len(TREES)
    np.testing.assert_allclose(trees.feet[order, :2], TREES[:, :2], atol=0.3)
    np.testing.assert_allclose(trees.height[order], TREES[:, 2], atol=0.4)
    np.testing.assert_allclose(trees.feet[:, 2], ground_at(trees.feet[:, :2]), atol=0.3)


@pytest.mark.parametrize("scheme", [ASPRS, None])
def test_returns_from_the_air_above_a_tree_are_not_its_top(scene, scheme):
    xyz, codes = scene
    rng = np.random.default_rng(3)
    x, y, height = TREES[2]
    ground = ground_at(np.array([[x, y]]))[0]
    strays = rng.uniform((x - 3, y - 3, height + 1), (x + 3, y + 3, height + 14), (40, 3))
    kept = np.isin(codes, (2, 5))
    # Producers do not mark all of them as noise.
    xyz = np.concatenate((xyz[kept], strays + np.array([0, 0, ground])))
    codes = np.concatenate((codes[kept], np.full(40, 1, np.uint8)))
    around = surroundings(xyz, codes, scheme, FEW)
    assert ((around.kind == PLANT) & ~around.lone & (around.height > height + 1)).any()
    trees = find_trees(around, min_height=3.0)
    assert sorted(trees.height) == pytest.approx(sorted(TREES[:, 2]), abs=0.4)


def test_lower_trees_than_asked_for_are_left_out(scene):
    xyz, codes = scene
    assert len(find_trees(surroundings(xyz, codes, ASPRS, FEW), min_height=12.0).height) == 2


def test_nothing_but_noise_is_nothing():
    around = surroundings(np.zeros((5, 3)), np.full(5, 7, np.uint8), ASPRS, FEW)
    assert len(around.xyz) == 0
    assert len(find_trees(around, 3.0).height) == 0


def test_single_points_are_lone_where_others_stand_together(scene):
    xyz, codes = scene
    dust = np.array([[70.0, 10.0, 134.0], [70.0, 70.0, 135.0], [70.3, 70.0, 135.0]])
    added = np.concatenate((xyz[codes == 5], dust, xyz[codes == 2]))
    around = surroundings(added, None, None, FEW)
    plants = (codes == 5).sum()
    assert around.lone[plants : plants + 3].all()
    assert around.lone[:plants].mean() < 0.01 and not around.lone[plants + 3 :].any()
    sparse = surroundings(np.concatenate((dust, xyz[codes == 2])), None, None, FEW)
    assert not sparse.lone.any()


def test_a_jib_over_open_ground_is_held_by_its_mast_and_a_flock_is_not(scene):
    xyz, codes = scene
    base = ground_at(np.array([[70.0, 60.0]]))[0]
    mast = np.array([(70.0, 60.0, base + z) for z in np.arange(0, 34, 0.2)])
    jib = np.array([(x, 60.0, base + 30) for x in np.arange(36, 78, 0.2)])
    flock = jib + np.array([0.0, -12.0, 3.0])
    ground = xyz[codes == 2]
    around = surroundings(np.concatenate((mast, jib, flock, ground)), None, None, FEW)
    kind = around.kind[len(mast) : len(mast) + len(jib) + len(flock)]
    assert (kind[: len(jib)] == PLANT).all()
    assert (kind[len(jib) :] == NO_OBSTACLE).all()


@pytest.mark.parametrize("seed", range(8))
def test_points_above_a_gap_in_their_column_are_in_the_air(seed):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 10, (60, 2))
    height = rng.normal(0, rng.choice([3.0, 15.0, 60.0]), 60) + rng.choice([0.0, 5.0, 20.0])
    expected = np.zeros(len(xy), bool)
    cell = np.floor(xy / COLUMN_M)
    for place in np.unique(cell, axis=0):
        rows = np.flatnonzero((cell == place).all(axis=1))
        rows, below, above = rows[np.argsort(height[rows])], 0.0, False
        if height[rows[-1]] <= GAP_M:
            continue
        for row in rows:
            above |= bool(height[row] - below > max(GAP_M, GAP * height[row]))
            expected[row], below = above, height[row]
    np.testing.assert_array_equal(above_gap(xy, height), expected)
