"""A written cloud is the cloud that is read back."""

from __future__ import annotations

import laspy
import numpy as np
import pyproj
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from scenenet.core.errors import InputError
from scenenet.pointcloud import PointCloud, class_scheme, read, survey_info, write_las


def cloud_of(xyz, crs=None) -> PointCloud:
    xyz = np.asarray(xyz, float).reshape(-1, 3)
    codes = (np.arange(len(xyz)) % 22).astype(np.uint8)
    return PointCloud(xyz, codes, class_scheme("edp"), crs)


@pytest.fixture
def cloud() -> PointCloud:
    xyz = np.random.default_rng(0).random((1000, 3)) * [500, 500, 60] + [544e3, 4634e3, 100]
    return cloud_of(xyz, pyproj.CRS.from_epsg(32629))


@pytest.mark.parametrize("suffix", ["las", "laz"])
def test_points_codes_and_coordinate_system_come_back(tmp_path, cloud, suffix):
    path = tmp_path / f"out.{suffix}"
    write_las(path, cloud)
    back = read(path, "edp")
    np.testing.assert_allclose(back.xyz, cloud.xyz, rtol=0, atol=0.000_501)
    np.testing.assert_array_equal(back.classification, cloud.classification)
    assert back.crs.to_epsg() == 32629
    info = survey_info(path)
    assert (info.format, info.version, info.point_format) == (suffix, "1.4", 6)
    np.testing.assert_allclose(info.mins, back.xyz.min(0), atol=1e-9)
    np.testing.assert_allclose(info.maxs, back.xyz.max(0), atol=1e-9)


def test_an_independent_reader_reads_the_same(tmp_path, cloud):
    path = tmp_path / "out.laz"
    extra = {"height": cloud.xyz[:, 2].astype("f4"), "tower": np.arange(1000, dtype="u2")}
    write_las(path, cloud, extra=extra)
    peer = laspy.read(path)
    np.testing.assert_allclose(np.asarray(peer.x), cloud.xyz[:, 0], rtol=0, atol=0.000_501)
    np.testing.assert_array_equal(np.asarray(peer.classification), cloud.classification)
    for name, values in extra.items():
        np.testing.assert_array_equal(peer[name], values)
        assert peer[name].dtype == values.dtype
    assert peer.header.parse_crs().to_epsg() == 32629
    assert set(np.asarray(peer.return_number)) == set(np.asarray(peer.number_of_returns)) == {1}
    assert peer.header.number_of_points_by_return[0] == 1000


def test_the_same_cloud_gives_the_same_bytes(tmp_path, cloud):
    write_las(tmp_path / "a.laz", cloud)
    write_las(tmp_path / "b.laz", cloud)
    assert (tmp_path / "a.laz").read_bytes() == (tmp_path / "b.laz").read_bytes()


def test_what_was_read_and_written_again_does_not_move(tmp_path, cloud):
    first, second = tmp_path / "a.laz", tmp_path / "b.laz"
    write_las(first, cloud)
    write_las(second, read(first))
    np.testing.assert_array_equal(read(first).xyz, read(second).xyz)


@given(
    arrays(np.float64, (7, 3), elements=st.floats(-1e6, 1e6)),
    st.sampled_from([0.001, 0.01, 1.0]),
)
def test_no_point_moves_more_than_half_a_step(tmp_path_factory, xyz, scale):
    path = tmp_path_factory.mktemp("write") / "out.las"
    write_las(path, cloud_of(xyz), scale=scale)
    assert np.abs(read(path).xyz - xyz).max() <= scale / 2 + 1e-6


def test_empty_and_single_clouds_are_written(tmp_path):
    for n in (0, 1):
        write_las(tmp_path / f"{n}.laz", cloud_of(np.ones((n, 3))))
        assert len(read(tmp_path / f"{n}.laz")) == n
        assert len(laspy.read(tmp_path / f"{n}.laz").points) == n


def test_points_too_far_apart_for_the_scale_are_refused(tmp_path):
    path = tmp_path / "out.las"
    with pytest.raises(InputError, match="apart"):
        write_las(path, cloud_of([[0, 0, 0], [1e7, 0, 0]]))
    with pytest.raises(InputError, match="not finite"):
        write_las(path, cloud_of([[0, 0, np.nan]]))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "extra",
    [
        {"height": np.zeros(3)},
        {"classification": np.zeros(2)},
        {"x" * 33: np.zeros(2)},
        {"phase": np.zeros(2, complex)},
    ],
)
def test_a_dimension_that_las_cannot_hold_is_refused(tmp_path, extra):
    with pytest.raises(ValueError):
        write_las(tmp_path / "out.las", cloud_of(np.zeros((2, 3))), extra=extra)


def test_another_suffix_is_refused(tmp_path, cloud):
    with pytest.raises(InputError, match=r"\.xyz"):
        write_las(tmp_path / "out.xyz", cloud)
