"""The shape of a labelled tower, measured in points."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.dataset.crops import Crop
from scenenet.dataset.tower_shapes import measure_shape
from scenenet.pointcloud.class_schemes import EDP
from scenenet.pointcloud.cloud import PointCloud
from scenenet.synthetic.codes import CONDUCTOR, TOWER
from scenenet.synthetic.scene.towers import KINDS, Size, place, sample

FOOT = np.array([1000.3, 2000.7, 50.0])
GROUND = 2


def surveyed(kind: str, height: float, size: Size, noise_m: float = 0.0, seed: int = 0):
    """A crop with a tower, its conductors and flat ground.

    Args:
        noise_m: m to each side of the axis, in which everything is labelled tower.
    """
    rng = np.random.default_rng(seed)
    structure = KINDS[kind](height, 1, 0, size)
    azimuth = np.radians(60)
    parts = [(place(sample(structure.members, 10.0, rng), 0, 0, 0, azimuth), TOWER)]
    s = np.arange(0.3, 28, 0.25)
    for end in place(structure.attachments, 0, 0, 0, azimuth):
        for side in (-1, 1):
            heading = side * np.array([np.cos(azimuth), np.sin(azimuth)])
            wire = end + np.column_stack([s[:, None] * heading, -0.1 * s + s**2 / 1800])
            parts.append((wire, CONDUCTOR))
    xy = rng.uniform(-28, 28, (20_000, 2))
    xy = xy[np.hypot(*xy.T) <= 28]
    parts.append((np.column_stack([xy, np.zeros(len(xy))]), GROUND))
    xyz = np.concatenate([points for points, _ in parts])
    codes = np.concatenate([np.full(len(points), code, np.uint8) for points, code in parts])
    above = (codes != TOWER) | (xyz[:, 2] >= 0)
    xyz, codes = xyz[above] + 0.02 * rng.standard_normal((above.sum(), 3)), codes[above]
    codes[np.abs(xyz[:, :2]).max(axis=1) <= noise_m] = TOWER
    crop = Crop("a", float(FOOT[0]), float(FOOT[1]), height, np.zeros((0, 4)))
    return crop, PointCloud(xyz + FOOT, codes, EDP)


@pytest.mark.parametrize(
    ("kind", "height", "width", "reach"),
    [
        ("tubular", 18.0, 0.3, 1.0),
        ("lattice_pole", 18.0, 1.0, 2.0),
        ("lattice", 26.0, 2.0, 4.0),
        ("lattice", 36.0, 4.0, 8.0),
        # The two lengths do not depend on each other.
        ("tubular", 18.0, 0.3, 4.0),
        ("lattice", 36.0, 4.0, 4.0),
    ],
)
def test_width_and_reach_of_towers_are_measured(kind, height, width, reach):
    """Although the ground and the conductors near the axis are labelled tower. The short arms of a
    pole have too few points in some surveys."""
    found = [
        measure_shape(*surveyed(kind, height, Size(width, reach), 1.9, seed))
        for seed in range(3 if kind == "tubular" else 1)
    ]
    half_widths = [shape.half_width for shape in found]
    reaches = [shape.reach for shape in found if shape.reach is not None]
    assert np.median(half_widths) == pytest.approx(width / 2, rel=0.2)
    assert np.median(reaches) == pytest.approx(reach, rel=0.15)


def test_labels_decide_where_a_tower_stands_and_not_how_wide_it_is():
    clean, noisy = (
        measure_shape(*surveyed("lattice_pole", 18.0, Size(1.0, 2.0), noise))
        for noise in (0.0, 1.9)
    )
    assert noisy.half_width == pytest.approx(clean.half_width, rel=0.02)
    assert noisy.reach == pytest.approx(clean.reach, rel=0.02)


def test_the_tolerance_is_the_thickness_of_the_wall():
    """The members of a lattice are a few centimetres thick. A tube of radius r lies between
    r^2 / 2 and r^2 along or across the line."""
    square = measure_shape(*surveyed("lattice", 26.0, Size(2.0, 4.0)))
    tube = measure_shape(*surveyed("tubular", 18.0, Size(2.0, 4.0)))
    assert 0.01 < square.spread < 0.15
    assert square.spread < tube.spread < 0.3


def test_a_tower_without_crossarms_has_no_reach():
    crop, cloud = surveyed("tubular", 18.0, Size(0.6, 0.4))
    kept = np.flatnonzero(cloud.classification != CONDUCTOR)
    shape = measure_shape(crop, cloud.select(kept))
    assert shape.half_width == pytest.approx(0.3, rel=0.15)
    assert shape.reach is None and shape.reach_spread is None


def test_where_no_body_stands_free_there_is_no_shape():
    crop, cloud = surveyed("tubular", 18.0, Size(0.3, 1.0))
    ground = cloud.classification == GROUND
    labelled = PointCloud(
        cloud.xyz[ground], np.where(np.arange(ground.sum()) < 50, TOWER, GROUND).astype("u1"), EDP
    )
    assert measure_shape(crop, labelled) is None
    unlabelled = PointCloud(cloud.xyz, np.full(len(cloud), GROUND, np.uint8), EDP)
    assert measure_shape(crop, unlabelled) is None
