"""Axes of detected voxels, looked for in one area or in many."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenenet.detection.candidates import axes
from scenenet.detection.detected_voxels import DetectedArea, DetectedVoxels, _sum
from scenenet.detection.settings import DetectionSettings

LENGTH, WIDTH = 400, 40


def detected(seed, share):
    """Voxels of 1 m in a strip: some columns of several levels, one near another."""
    random = np.random.default_rng(seed)
    columns = random.choice(LENGTH * WIDTH, int(share * LENGTH * WIDTH), replace=False)
    levels = random.integers(1, 12, len(columns))
    x, y = np.repeat(columns // WIDTH, levels), np.repeat(columns % WIDTH, levels)
    z = np.concatenate([np.arange(n) for n in levels])
    centres = np.column_stack([x, y, z]) + np.array([5000.5, 300.5, 20.5])
    return DetectedVoxels(centres, random.random(len(centres)).astype(np.float32), 1.0), centres


class Strips:
    """The same voxels in areas of ``edge`` m with ``beside`` m more, whatever is asked for."""

    def __init__(self, whole, centres, edge, beside):
        self.whole, self.centres, self.edge, self.beside = whole, centres, edge, beside
        self.offset, self.voxel_size = whole.offset, whole.voxel_size
        self.read = []

    def areas(self, beside):
        starts = range(0, LENGTH, self.edge)
        return [partial(self.area, start, self.beside) for start in starts]

    def area(self, start, beside):
        self.read.append(beside)
        low, high = start - 0.5, start + self.edge - 0.5
        x = self.centres[:, 0] - self.offset[0]
        near = (x >= low - beside) & (x < high + beside)
        voxels = DetectedVoxels(
            self.centres[near], self.whole.probability[near], self.voxel_size, self.offset
        )
        core, seen = (low, -np.inf, high, np.inf), (low - beside, -np.inf, high + beside, np.inf)
        return DetectedArea(voxels, core, seen, partial(self.area, start, 2 * beside))


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 10**6), share=st.sampled_from([0.02, 0.2]), edge=st.sampled_from([40, 130])
)
def test_axes_do_not_depend_on_the_areas(seed, share, edge):
    whole, centres = detected(seed, share)
    at_once = axes(whole, DetectionSettings(), 3.0)
    assert len(at_once) > 20
    for beside in (5, 60):
        strips = Strips(whole, centres, edge, beside)
        assert np.array_equal(axes(strips, DetectionSettings(), 3.0), at_once)


def test_more_is_looked_at_where_an_area_does_not_decide():
    whole, centres = detected(0, 0.2)
    strips = Strips(whole, centres, 130, 5)
    axes(strips, DetectionSettings(), 3.0)
    assert max(strips.read) > 5


def test_without_voxels_there_is_no_axis():
    none = DetectedVoxels(np.empty((0, 3)), np.empty(0), 1.0)
    assert axes(none, DetectionSettings(), 3.0).shape == (0, 2)
    assert len(none.within(np.zeros(2), 5.0)) == 0


def test_voxels_within_a_radius_are_those_at_that_distance():
    whole, centres = detected(3, 0.2)
    places = centres[:, :2] - whole.offset[:2]
    for place in np.random.default_rng(1).uniform((-5, -5), (LENGTH + 5, WIDTH + 5), (50, 2)):
        near = np.flatnonzero(np.hypot(*(places - place).T) <= 6.2)
        assert set(whole.within(place, 6.2).tolist()) == set(near.tolist())


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_sums_are_those_of_numpy(kind):
    random = np.random.default_rng(0)
    for n in (1, 5, 8, 20, 128, 129, 300):
        values = random.random(n).astype(kind)
        assert _sum(values) == values.sum()
