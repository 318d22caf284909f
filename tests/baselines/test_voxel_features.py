"""Features of voxels in scenes with known values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenenet.baselines.voxel_features import FARTHEST_CONDUCTOR_M, FEATURES, voxel_features
from scenenet.dataset.voxels import VoxelGrid, VoxelSample, voxelise
from scenenet.pointcloud import PointCloud, class_scheme

NAMES = [feature.name for feature in FEATURES]
SIDE, POLE = 40.0, 14.0


def flat_ground(slope: float = 0.0, gap: float = 0.25) -> np.ndarray:
    x, y = np.meshgrid(np.arange(gap / 2, SIDE, gap), np.arange(gap / 2, SIDE, gap))
    return np.column_stack([x.ravel(), y.ravel(), slope * x.ravel() + 0.01])


def pole(height: float = POLE, foot: float = 0.0) -> np.ndarray:
    z = np.arange(0.05, height, 0.1)
    return np.column_stack([np.full(len(z), 20.1), np.full(len(z), 20.1), foot + z])


def conductor(height: float = 12.1) -> np.ndarray:
    x = np.arange(0.05, SIDE, 0.1)
    return np.column_stack([x, np.full(len(x), 20.1), np.full(len(x), height)])


def sample_of(*parts: np.ndarray, voxel_size: float = 1.0, origin=(0.0, 0.0, 0.0), shape=None):
    xyz = np.concatenate(parts)
    cells = round(SIDE / voxel_size)
    grid = VoxelGrid(origin, voxel_size, shape or (cells, cells, cells))
    cloud = PointCloud(xyz, np.full(len(xyz), 2, np.uint8), class_scheme("edp"))
    return voxelise(cloud, grid)


def table(sample: VoxelSample) -> dict[str, np.ndarray]:
    return dict(zip(NAMES, voxel_features(sample).T, strict=True))


def nearest(sample: VoxelSample, xyz) -> int:
    """Row of the occupied voxel with the nearest centre."""
    return int(np.linalg.norm(sample.grid.centres(sample.index) - xyz, axis=1).argmin())


def at(sample: VoxelSample, xyz) -> dict[str, float]:
    row = nearest(sample, xyz)
    return {name: float(column[row]) for name, column in table(sample).items()}


def test_each_feature_has_a_unique_name_a_unit_and_a_meaning():
    assert len(set(NAMES)) == len(NAMES) <= 26
    assert all(f.unit in {"m", "m^2", "1"} and f.meaning for f in FEATURES)


def test_a_row_per_voxel_and_a_column_per_feature():
    sample = sample_of(flat_ground(), pole(), conductor())
    features = voxel_features(sample)
    assert features.shape == (len(sample.index), len(FEATURES))
    assert features.dtype == np.float32
    assert np.isfinite(features).all()


def test_the_height_of_a_pole_is_measured():
    middle = at(sample_of(flat_ground(), pole()), (20.1, 20.1, 7.5))
    assert middle["height"] == pytest.approx(7.5, abs=0.5)
    assert middle["run_1"] == middle["run_2"] == POLE
    assert middle["run_up_2"] == 7  # its own voxel and six above
    assert middle["top_2"] == pytest.approx(POLE, abs=0.5)
    assert middle["filled_above_2"] == 6
    assert middle["filled_5_above_2"] == middle["filled_5_below_2"] == 5
    assert middle["share_below_2"] == 1
    assert middle["verticality_4"] == pytest.approx(1)
    assert middle["linearity_4"] == pytest.approx(1)
    assert middle["protrusion"] == pytest.approx(6.5)  # above ground voxels, 1 m high
    assert middle["reach_3"] == pytest.approx(1 / 29)  # columns of 1 m within 3 m
    assert middle["area_2"] == 5
    assert middle["conductor_distance"] == FARTHEST_CONDUCTOR_M
    assert middle["conductor_6"] == 0


def test_ground_has_no_height():
    ground = at(sample_of(flat_ground(), pole()), (5.5, 5.5, 0.5))
    assert ground["height"] == pytest.approx(0.5)
    assert ground["run_2"] == 1
    assert ground["planarity_4"] > 0.9
    assert ground["tall_6"] == 0


def test_conductors_are_measured_from_the_pole_and_from_themselves():
    sample = sample_of(flat_ground(), pole(), conductor())
    body = at(sample, (20.1, 20.1, 5.5))
    assert (
        body["conductor_distance"] <= 4
    )  # near the pole the surroundings of the conductor are not linear
    assert body["conductor_6"] >= 6
    assert at(sample, (5.5, 20.5, 12.5))["conductor_distance"] == 0
    aside = at(sample, (20.5, 30.5, 0.5))
    assert aside["conductor_distance"] == pytest.approx(10, abs=1)
    assert aside["conductor_6"] == 0


def test_a_stray_return_does_not_raise_the_top():
    bird = np.array([[20.1, 20.1, 38.0]])
    with_bird = at(sample_of(flat_ground(), pole(), bird), (20.1, 20.1, 7.5))
    without = at(sample_of(flat_ground(), pole()), (20.1, 20.1, 7.5))
    assert with_bird == pytest.approx(without, rel=0.02)  # the bird counts as a point


def test_height_is_above_the_ground_also_on_a_slope():
    slope = 0.3
    sample = sample_of(flat_ground(slope), pole(foot=slope * 20.1))
    body = at(sample, (20.1, 20.1, slope * 20.1 + 7.5))
    assert body["height"] == pytest.approx(7.5, abs=1)
    ground = table(sample)["height"][sample.count > 1]
    assert np.median(np.abs(ground)) < 1


def test_a_hole_in_the_ground_does_not_raise_its_neighbours():
    pit = np.array([[18.5, 20.1, -5.0]])
    grid = {"origin": (0.0, 0.0, -8.0), "shape": (40, 40, 40)}
    middle = at(sample_of(flat_ground(), pole(), pit, **grid), (20.1, 20.1, 7.5))
    assert middle["height"] == pytest.approx(7.5, abs=0.5)


def test_features_do_not_depend_on_labels_or_position():
    sample = sample_of(flat_ground(), pole(), conductor())
    expected = voxel_features(sample)
    labelled = replace(sample, labelled=np.ones(len(sample.index), bool))
    np.testing.assert_array_equal(voxel_features(labelled), expected)
    moved = replace(sample, grid=replace(sample.grid, origin=(5e5, 4.6e6, 100.0)))
    np.testing.assert_array_equal(voxel_features(moved), expected)


def test_a_scene_moved_by_whole_voxels_has_the_same_features():
    parts = flat_ground(), pole(), conductor()
    one = sample_of(*parts, shape=(40, 48, 48))
    other = sample_of(*(p + np.array([6.0, 3.0, 0.0]) for p in parts), shape=(40, 48, 48))
    np.testing.assert_allclose(voxel_features(other), voxel_features(one), atol=1e-5)


def test_a_scene_turned_by_a_quarter_has_the_same_features():
    parts = [flat_ground(), pole(), conductor()]
    one = sample_of(*parts)
    turned = [np.column_stack([SIDE - p[:, 1], p[:, 0], p[:, 2]]) for p in parts]
    other = sample_of(*turned)
    z, y, x = np.unravel_index(one.index, one.grid.shape)
    index = np.ravel_multi_index((z, x, one.grid.shape[1] - 1 - y), one.grid.shape)
    rows = np.searchsorted(other.index, index)
    np.testing.assert_array_equal(other.index[rows], index)
    np.testing.assert_allclose(voxel_features(other)[rows], voxel_features(one), atol=1e-5)


def test_half_the_voxel_size_gives_about_the_same():
    parts = flat_ground(), pole(), conductor()
    coarse = at(sample_of(*parts), (20.1, 20.1, 7.5))
    fine = at(sample_of(*parts, voxel_size=0.5), (20.1, 20.1, 7.5))
    for name in ("height", "run_2", "top_2", "filled_above_2", "protrusion", "overtop_12"):
        assert fine[name] == pytest.approx(coarse[name], abs=1.0), name
    for name in ("share_below_2", "linearity_4", "verticality_4", "tall_6", "tall_ring"):
        assert fine[name] == pytest.approx(coarse[name], abs=0.1), name
    assert fine["conductor_distance"] == pytest.approx(coarse["conductor_distance"], abs=1.0)


def test_a_run_continues_over_a_gap_of_one_metre_but_not_of_two():
    def run(missing: tuple[float, float]) -> float:
        body = pole()
        body = body[(body[:, 2] < missing[0]) | (body[:, 2] >= missing[1])]
        return at(sample_of(flat_ground(), body), (20.1, 20.1, 9.5))["run_1"]

    assert run((5.0, 6.0)) == POLE
    assert run((5.0, 7.0)) == POLE - 7


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 3, 2), (5, 4, 3)])
def test_features_exist_on_small_grids(shape):
    n = int(np.prod(shape))
    grid = VoxelGrid((0.0, 0.0, 0.0), 1.0, shape)
    for index in ([0], range(n)):
        at_these = np.array(index, np.int32)
        count = np.ones(len(at_these), np.int32)
        features = voxel_features(VoxelSample("", grid, at_these, count, count > 1))
        assert features.shape == (len(at_these), len(FEATURES))
        assert np.isfinite(features).all()


def test_no_voxels_have_no_features():
    nothing = np.empty(0, np.int32)
    sample = VoxelSample("", VoxelGrid((0.0,) * 3, 1.0, (2, 2, 2)), nothing, nothing, nothing > 0)
    assert voxel_features(sample).shape == (0, len(FEATURES))


MEDIAN_OFF = {
    "height": 0.5,
    "top_2": 1.0,
    "run_2": 1.0,
    "mean_top_6": 2.0,
    "protrusion": 1.0,
    "conductor_distance": 1.0,
    "tall_6": 0.1,
    "linearity_4": 0.1,
}
"""Allowed median difference between the feature of a voxel and those of its eight parts."""


@pytest.mark.parametrize("name", ["sample_575", "sample_593"])
def test_features_of_real_voxels_agree_between_resolutions(real_data, name):
    from scenenet.pointcloud import read

    cloud = read(real_data / "ts40k" / f"{name}.npy", "edp")
    whole, parts = (voxelise(cloud, VoxelGrid.cube(cloud.xyz, n)) for n in (64, 128))
    zyx = np.array(np.unravel_index(parts.index, parts.grid.shape)) // 2
    row = np.searchsorted(whole.index, np.ravel_multi_index(tuple(zyx), whole.grid.shape))
    coarse, fine = table(whole), table(parts)
    for feature, allowed in MEDIAN_OFF.items():
        off = np.abs(fine[feature] - coarse[feature][row])
        assert np.median(off) <= allowed, feature
