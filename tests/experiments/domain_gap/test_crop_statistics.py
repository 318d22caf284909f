"""Properties of a crop that was built with known values."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.experiments.domain_gap.crop_statistics import (
    PROPERTIES,
    crop_statistics,
    voxel_statistics,
)
from scenenet.pointcloud import PointCloud, class_scheme

SLOPE = math.radians(8.0)
SIDE = 30.0


@pytest.fixture(scope="module")
def built() -> PointCloud:
    """Sloping ground at 25 points per m^2, a 16 m pole, three conductors, a grove, two strays."""
    rng = np.random.default_rng(0)
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.arange(0.1, SIDE, 0.2)] * 2))
    parts, codes = [np.column_stack((x, y, np.tan(SLOPE) * x))], [np.full(len(x), 10)]
    foot = np.tan(SLOPE) * 15
    pole = np.column_stack((*rng.normal(15, 0.1, (2, 320)), foot + np.linspace(0, 16, 320)))
    parts.append(pole)
    codes.append(np.full(len(pole), 15))
    along = np.arange(0, SIDE, 0.25)
    for across, height in ((-1.0, 15.0), (0.0, 16.5), (1.0, 15.0)):
        z = foot + height + (along - 15) ** 2 / 2000
        parts.append(np.column_stack((along, np.full(len(along), 15 + across), z)))
        codes.append(np.full(len(along), 16))
    grove = rng.uniform([0, 0, 4], [6, 30, 10], (4000, 3))
    grove[:, 2] += np.tan(SLOPE) * grove[:, 0]
    parts.append(grove)
    codes.append(np.full(len(grove), 12))
    parts.append(np.array([[10.0, 10, foot + 50], [20, 20, foot + 60]]))
    codes.append(np.full(2, 7))
    return PointCloud(
        np.concatenate(parts) + np.array([500_000, 4_600_000, 100]),
        np.concatenate(codes).astype(np.uint8),
        class_scheme("edp"),
    )


def test_every_property_is_measured(built):
    found = crop_statistics(built)
    assert set(found) == set(PROPERTIES)
    assert all(np.isfinite(value) for value in found.values())


@pytest.mark.parametrize(
    ("name", "value", "within"),
    [
        ("ground_density", 25.0, 0.3),
        ("slope", 8.0, 0.1),
        ("roughness", 0.0, 0.01),
        ("tower_height", 16.0, 0.05),
        ("tower_points", 320, 0),
        ("tower_near_ground", 100 * 1.5 / 16, 1.0),
        ("tower_body", 20.0, 1.5),
        ("wires", 3, 0),
        ("wire_spacing", math.hypot(1.0, 1.5), 0.05),
        ("wire_density", 12.0, 0.5),
        ("wire_curvature", 1.0, 0.05),
        ("canopy_cover", 20.0, 1.0),
        ("canopy_middle", 7.0, 0.3),
        ("canopy_gaps", 100.0, 0.0),
        ("strays", 2, 0),
        ("stray_top", 60.0, 1.0),
        ("shadow", 0.0, 0.0),
        ("evenness", 2.0, 0.02),
        ("class_15", 100 * 320 / 27184, 0.05),
    ],
)
def test_a_property_has_the_value_that_was_built_in(built, name, value, within):
    assert crop_statistics(built)[name] == pytest.approx(value, abs=within + 1e-9)


def test_absent_objects_have_no_value(built):
    ground = built.classification == 10
    found = crop_statistics(
        PointCloud(built.xyz[ground], built.classification[ground], built.scheme)
    )
    for name in ("tower_height", "wire_height", "canopy_height", "stray_top"):
        assert np.isnan(found[name])
    assert found["strays"] == found["canopy_cover"] == 0


def test_a_hole_is_a_shadow(built):
    hole = (np.abs(built.xyz[:, :2] - built.xyz[:, :2].mean(axis=0) - 5) < 2).all(axis=1)
    found = crop_statistics(PointCloud(built.xyz[~hole], built.classification[~hole], built.scheme))
    assert 0.5 < found["shadow"] < 3.0


def test_voxels_of_a_plane_have_eight_neighbours():
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.arange(0.5, 64)] * 2))
    xyz = np.column_stack((x, y, np.full(len(x), 32.0)))
    cloud = PointCloud(xyz, np.full(len(x), 10, np.uint8), class_scheme("edp"))
    grid = VoxelGrid((0.0, 0.0, 0.0), 1.0, (64, 64, 64))
    found = voxel_statistics(voxelise(cloud, grid))
    assert found["neighbours_50"] == 8
    assert found["filling_50"] == found["column_50"] == 1
    assert found["alone"] == found["above"] == 0
