"""Measurements: what they say about points and voxels, and what is refused."""

from __future__ import annotations

import os

import laspy
import numpy as np
import pytest
from fixtures.measurement_file import BRIGHT
from fixtures.spools import spool_of
from hypothesis import given
from hypothesis import strategies as st

from scenenet.core.errors import InputError
from scenenet.core.provided_code import MEASUREMENTS
from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.interpretability.bounded_measurement import bounded
from scenenet.measurement import PointFields, measurement_named, measurement_of_file
from scenenet.measurement.heights import columns_around, heights
from scenenet.measurement.outside import tried_voxels
from scenenet.models.scenenet import SceneNet
from scenenet.pointcloud import PointCloud, iter_chunks, read
from scenenet.pointcloud.class_schemes import ASPRS
from scenenet.prediction.work.tile_predictor import TilePredictor

pytestmark = pytest.mark.usefixtures("nothing_provided")


def test_the_measurements_of_the_package_say_what_their_names_say():
    points = PointFields(
        np.array([0, 65535, 13107], np.uint16), np.array([1, 2, 1]), np.array([2, 2, 1])
    )
    assert measurement_named("intensity").of_points(points).tolist() == [0, 1, 0.2]
    assert measurement_named("last_returns").of_points(points).tolist() == [0, 1, 1]
    voxels = tried_voxels(measurement_named("height"))
    assert voxels.height is not None
    np.testing.assert_allclose(
        measurement_named("height").phi(voxels), np.minimum(voxels.height / 50, 1), rtol=1e-6
    )


def test_a_voxel_has_the_mean_of_its_points():
    xyz = np.array([[0.5, 0.5, 0.5], [0.6, 0.5, 0.5], [1.5, 0.5, 0.5]])
    fields = PointFields(np.array([0, 65535, 6553], np.uint16))
    cloud = PointCloud(xyz, np.zeros(3, np.uint8), ASPRS, fields=fields)
    sample = voxelise(cloud, VoxelGrid((0, 0, 0), 1.0, (1, 1, 2)), measurement="intensity")
    np.testing.assert_allclose(sample.phi("intensity"), [0.5, 6553 / 65535], rtol=1e-6)
    with pytest.raises(InputError, match="made without returns, which measurement 'last_returns'"):
        voxelise(cloud, VoxelGrid((0, 0, 0), 1.0, (1, 1, 2))).phi("last_returns")


@given(st.lists(st.tuples(*[st.integers(-8, 8)] * 3), min_size=1, max_size=40, unique=True))
def test_a_height_is_above_the_lowest_voxel_around(zyx):
    voxels, size = np.array(zyx), 2.0
    near = columns_around(size)
    for voxel, height in zip(voxels, heights(voxels, voxels, size), strict=True):
        around = (np.abs(voxels[:, 1:] - voxel[1:]) <= near).all(axis=1)
        assert height == size * (voxel[0] - voxels[around, 0].min())


def test_columns_of_tiles_have_all_that_is_above_and_below(tmp_path):
    xyz = np.random.default_rng(0).uniform((-70, -70, -70), (70, 70, 140), (3000, 3))
    spool = spool_of(tmp_path / "spool", 1.0, [xyz])
    everything = np.concatenate([tile.zyx() for tile in spool.tiles()])
    found = spool.columns_around((1, 0, -1), (5, 9))
    low, high = np.array([-5, -64 - 9]), np.array([64 + 5, 9])
    inside = ((everything[:, 1:] >= low) & (everything[:, 1:] < high)).all(axis=1)
    assert {*map(tuple, found)} == {*map(tuple, everything[inside])}
    assert np.ptp(found[:, 0]) > 128  # of several tiles


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("(points.intensity > 30_000).astype(float)", "points.intensity / 30_000"), r"lies in"),
        (("(points.intensity > 30_000).astype(float)", "points.intensity[:3] * 0"), "one number"),
        (("(points.intensity > 30_000)", "(points.colour > 0)"), "line 10.*AttributeError"),
        (('"intensity"}', '"colour"}'), "needs colour, and it may have"),
        (('name = "bright"', 'name = "dark"'), "registers 'dark'"),
        (("@register\n", ""), "registers no measurement"),
    ],
)
def test_a_file_that_is_no_measurement_is_refused_with_its_fault(tmp_path, change, said):
    (tmp_path / "bright.py").write_text(BRIGHT.replace(*change))
    with pytest.raises(InputError, match=f"bright.py.*{said}"):
        measurement_of_file(tmp_path / "bright.py")


def test_a_name_is_that_of_one_measurement(tmp_path):
    with pytest.raises(InputError, match="did you mean 'presence'"):
        measurement_named("presense")
    (tmp_path / "density.py").write_text(BRIGHT)
    with pytest.raises(InputError, match="a measurement of the package is called 'density'"):
        MEASUREMENTS.provide([tmp_path / "density.py"])
    assert "density" not in os.environ[MEASUREMENTS.variable]


@pytest.mark.parametrize("name", ["density", "height", "intensity", "last_returns"])
def test_the_certificate_bounds_a_measurement(name):
    (statement,) = bounded(name, 1.0)
    assert statement.holds
    assert statement.value is not None and 0 < statement.value <= 1
    assert bounded("presence", 1.0) == ()


@pytest.fixture
def dark(tmp_path):
    """A survey that records no intensity, with one return of each pulse."""
    las = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
    las.xyz = np.random.default_rng(0).uniform(0, 10, (500, 3))
    las.return_number[:], las.number_of_returns[:] = 1, 1
    las.write(tmp_path / "dark.laz")
    return tmp_path / "dark.laz"


def test_fields_are_read_in_chunks_and_must_be_recorded(dark):
    with pytest.raises(InputError, match=r"dark\.laz: it has no intensity"):
        list(iter_chunks(dark, chunk_points=200, fields=("intensity",)))
    whole = read(dark, fields=("returns",)).fields
    assert whole is not None and whole.is_last.all() and len(whole) == 500
    assert read(dark).fields is None


def test_samples_have_no_fields(tmp_path):
    np.save(tmp_path / "s.npy", np.zeros((4, 4), np.float32))
    with pytest.raises(InputError, match=r"s\.npy: it has no numbers of returns"):
        read(tmp_path / "s.npy", fields=("returns",))


def test_voxels_too_small_for_heights_are_refused():
    model = SceneNet(["cylinder"], (5, 5, 5))
    assert TilePredictor(model, "height", 0.5, 1)
    with pytest.raises(InputError, match=r"voxels of 0\.05 m are too small for measurement"):
        TilePredictor(model, "height", 0.05, 1)
