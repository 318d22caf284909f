"""From detected voxels to towers, with voxels placed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.cluster import DBSCAN

from scenenet.detection import DetectionSettings, detect_towers

ORIGIN = np.array([500_000.0, 4_630_000.0, 100.0])


def column(x: float, y: float, low: int, high: int) -> np.ndarray:
    """Middles of voxels of 1 m above one another, from ``low`` up to below ``high`` m."""
    z = np.arange(low, high) + 0.5
    return np.column_stack([np.full(len(z), x), np.full(len(z), y), z]) + ORIGIN


def ground(size: float = 40.0) -> np.ndarray:
    x, y = np.meshgrid(np.arange(-size, size), np.arange(-size, size))
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.5)]) + ORIGIN


def detect(centres, probability=0.9, surroundings=None, voxel_size=1.0, **changes):
    given_probability = np.broadcast_to(np.asarray(probability, float), len(centres))
    around = ground() if surroundings is None else surroundings
    settings = DetectionSettings(**changes)
    return detect_towers(centres, given_probability, around, voxel_size, settings)


def test_nothing_detected_no_tower():
    assert detect(np.empty((0, 3))) == []


def test_a_column_is_a_tower_with_its_place_foot_and_height():
    [tower] = detect(column(3.0, -2.0, 5, 15))
    assert (tower.x, tower.y) == pytest.approx((500_003.0, 4_629_998.0))
    assert tower.base == pytest.approx(100.0)  # the ground, not the lowest detected voxel
    assert tower.height == pytest.approx(15.0)
    assert tower.voxels.tolist() == list(range(10))


def test_a_voxel_pulls_the_centre_as_strongly_as_it_is_probable():
    both = np.concatenate([column(0.0, 0.0, 0, 10), column(4.0, 0.0, 0, 10)])
    [tower] = detect(both, np.repeat([0.75, 0.25], 10))
    assert tower.x - ORIGIN[0] == pytest.approx(1.0)
    assert tower.probability == 0.75


def test_what_lies_above_one_another_is_one_tower_however_far():
    parts = np.concatenate([column(0, 0, 0, 3), column(0, 0, 30, 33)])
    assert len(detect(parts)) == 1


def test_what_lies_further_apart_than_eps_is_two_towers():
    for apart, n in ((5.9, 1), (6.1, 2)):
        assert len(detect(np.concatenate([column(0, 0, 0, 12), column(apart, 0, 0, 12)]))) == n


def test_a_bush_is_no_tower():
    assert detect(column(0, 0, 0, 8)) == []
    assert len(detect(column(0, 0, 0, 8), min_height=7.0, min_body=7.0)) == 1


def test_a_treetop_seen_at_one_place_is_no_tower_however_high():
    top = column(0, 0, 15, 20)
    assert detect(top) == []
    assert len(detect(top, min_body=5.0)) == 1


def test_a_few_voxels_are_no_tower():
    far_apart = column(0, 0, 0, 20)[[0, -1]]
    assert detect(far_apart) == []
    assert len(detect(far_apart, min_voxels=2)) == 1


def test_one_return_from_below_the_ground_does_not_make_a_tower_of_a_bush():
    below = np.concatenate([ground(), ORIGIN[None] - np.array([0, 0, 30])])
    assert detect(column(0, 0, 0, 6), surroundings=below) == []


def test_a_tower_on_a_slope_stands_on_the_ground_at_its_foot():
    slope = ground()
    slope[:, 2] += slope[:, 0] - ORIGIN[0]  # 45 degrees
    [tower] = detect(column(0, 0, 5, 20), surroundings=slope)
    assert tower.base == pytest.approx(100.0, abs=5.0)  # and not 40 m down the hill


def test_towers_come_with_the_most_probable_first():
    three = [column(x, 0, 0, 12) for x in (0, 50, 100)]
    towers = detect(np.concatenate(three), np.repeat([0.5, 0.9, 0.7], 12))
    assert [round(t.x - ORIGIN[0]) for t in towers] == [50, 100, 0]


@settings(max_examples=30)
@given(st.integers(0, 1000), st.integers(1, 60))
def test_towers_are_the_planar_clusters_of_the_voxels(seed, n):
    rng = np.random.default_rng(seed)
    centres = rng.integers(0, 40, (n, 3)) + ORIGIN + 0.5
    labels = DBSCAN(eps=3.0, min_samples=1).fit_predict(centres[:, :2] - ORIGIN[:2])
    found = detect(centres, eps=3.0, min_voxels=1, min_height=0.0, min_body=0.0)
    groups = {frozenset(np.flatnonzero(labels == label).tolist()) for label in set(labels)}
    assert {frozenset(t.voxels.tolist()) for t in found} == groups


@settings(max_examples=20)
@given(st.permutations(range(24)))
def test_order_of_voxels_does_not_matter(order):
    centres = np.concatenate([column(0, 0, 0, 12), column(30, 0, 0, 12)])
    probability = np.linspace(0.5, 0.9, 24)
    one, other = detect(centres, probability), detect(centres[order], probability[order])
    for a, b in zip(one, other, strict=True):
        assert (a.x, a.y, a.base, a.height) == pytest.approx((b.x, b.y, b.base, b.height))
