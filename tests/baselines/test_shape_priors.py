"""A method without training: ground, slender columns, axis, slices."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.baselines.shape_priors import cut_out, height_above_ground
from scenenet.metrics.tower_matching import match_towers
from scenenet.metrics.voxel_scores import Confusion

PLACE = np.array([544_000.0, 4_634_000.0, 200.0])
RNG_SEED = 3


def ground(slope: float = 0.0, half: float = 30.0) -> np.ndarray:
    rng = np.random.default_rng(RNG_SEED)
    xy = rng.uniform(-half, half, (30_000, 2))
    return np.column_stack([xy, slope * xy[:, 0]])


def pole(height: float = 15.0) -> np.ndarray:
    """A pole 0.3 m wide with a crossarm of 3 m along y."""
    rng = np.random.default_rng(RNG_SEED + 1)
    body = rng.uniform(-0.15, 0.15, (600, 3))
    body[:, 2] = rng.uniform(0, height, 600)
    arm = rng.uniform(-0.1, 0.1, (150, 3))
    arm[:, 1] = rng.uniform(-1.5, 1.5, 150)
    arm[:, 2] += height - 0.5
    return np.concatenate([body, arm])


def conductors(height: float = 14.5) -> np.ndarray:
    """Three conductors along x over the whole scene."""
    x = np.arange(-30, 30, 0.1)
    lines = [np.column_stack([x, np.full(len(x), y), np.full(len(x), height)]) for y in (-1, 0, 1)]
    return np.concatenate(lines)


def tree(x: float, y: float, height: float = 12.0) -> np.ndarray:
    rng = np.random.default_rng(RNG_SEED + 2)
    z = rng.uniform(1, height, 3000)
    wide = 3.0 * np.sqrt(rng.uniform(0, 1, 3000)) * np.sin(np.pi * z / (height + 1))
    turn = rng.uniform(0, 2 * np.pi, 3000)
    return np.column_stack([x + wide * np.cos(turn), y + wide * np.sin(turn), z])


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_heights_are_above_the_ground_also_on_a_slope(slope):
    xyz = np.concatenate([ground(slope), [[5.0, 2.0, 12.0 + slope * 5.0]]]) + PLACE
    height = height_above_ground(xyz)
    assert height[-1] == pytest.approx(12.0, abs=0.5)
    assert np.percentile(height[:-1], 95) < 0.6


@pytest.mark.parametrize("slope", [0.0, 0.2])
def test_a_pole_with_its_crossarm_is_cut_out(slope):
    parts = [ground(slope), pole(), conductors(), tree(15, 12)]
    true = np.concatenate([np.full(len(part), n == 1) for n, part in enumerate(parts)])
    cut = cut_out(np.concatenate(parts) + PLACE)
    match = match_towers(cut.places, np.array([[*PLACE[:2], PLACE[2], 15.0]]))
    assert (len(match.errors), match.n_predicted) == (1, 1)
    assert match.errors[0] < 0.3
    assert match.height_errors[0] < 1.5 and match.base_errors[0] < 0.6
    counts = Confusion.of(cut.points, true)
    assert counts.precision > 0.85 and counts.recall > 0.85


def test_neither_a_tree_nor_a_lone_pole_nor_conductors_are_towers():
    for parts in (
        [ground(), tree(0, 0, 18.0), conductors()],
        [ground(), pole()],
        [ground(), conductors()],
    ):
        cut = cut_out(np.concatenate(parts) + PLACE)
        assert len(cut.places) == 0 and not cut.points.any()


def test_no_points_have_no_towers():
    cut = cut_out(np.empty((0, 3)))
    assert cut.points.shape == (0,) and cut.places.shape == (0, 4)
