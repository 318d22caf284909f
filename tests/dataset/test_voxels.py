"""From points to voxels, with points placed by hand."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from scenenet.core.errors import InputError, OutputError
from scenenet.dataset.crops import CropSettings, Truth, cut_crops
from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.dataset.voxel_cache import build, load
from scenenet.dataset.voxels import BORDER_M, VoxelGrid, VoxelSettings, voxelise
from scenenet.dataset.zarr_store import StoreReader
from scenenet.pointcloud import PointCloud, class_scheme

EDP = class_scheme("edp")


def cloud(points, codes=None) -> PointCloud:
    xyz = np.array(points, float).reshape(-1, 3)
    codes = np.full(len(xyz), 2) if codes is None else np.array(codes)
    return PointCloud(xyz, codes.astype(np.uint8), EDP)


points_of_any_crop = arrays(
    np.float64,
    st.tuples(st.integers(1, 60), st.just(3)),
    elements=st.floats(-75, 75, width=32),
).map(lambda xyz: xyz + np.array([500_000.0, 4_630_000.0, 100.0]))


def test_points_placed_by_hand_fall_into_their_voxels():
    grid = VoxelGrid((0.0, 0.0, 0.0), 1.0, (2, 3, 4))
    xyz = [[0.5, 0.5, 0.5], [3.5, 0.5, 0.5], [0.5, 2.5, 0.5], [0.5, 0.5, 1.5], [3.5, 2.5, 1.5]]
    # [z, y, x] in C order: a step in y is 4, a step in z is 12.
    assert grid.voxel_of(np.array(xyz)).tolist() == [0, 3, 8, 12, 23]


def test_points_on_the_upper_border_belong_to_the_last_voxel():
    grid = VoxelGrid.cube(np.array([[0, 0, 0], [4, 4, 4.0]]), 4)
    assert grid.voxel_of(np.array([[0, 0, 0], [4, 4, 4.0]])).tolist() == [0, 63]


def test_a_point_on_an_inner_border_belongs_to_the_upper_voxel():
    grid = VoxelGrid((0.0, 0.0, 0.0), 1.0, (1, 1, 3))
    assert grid.voxel_of(np.array([[1.0, 0, 0], [2.0, 0, 0]])).tolist() == [1, 2]


def test_the_cube_is_centred_on_the_bounding_box_and_its_longest_side_sets_the_voxel():
    grid = VoxelGrid.cube(np.array([[10, 20, 0], [18, 22, 4.0]]), 4)
    assert grid.voxel_size == 2.0
    assert grid.origin == (10.0, 17.0, -2.0)
    assert grid.shape == (4, 4, 4)


def test_the_metric_grid_has_as_many_voxels_as_the_points_need():
    grid = VoxelGrid.metric(np.array([[0, 0, 0], [8, 3, 0.5]]), 2.0)
    assert grid.shape == (1, 2, 4)
    assert grid.origin == pytest.approx((0.0, -0.5, -0.75), abs=2 * BORDER_M)


@given(
    st.sampled_from([0.001, 0.01]),
    st.sampled_from([0.3, 0.7, 0.9, 1.1]),
    st.integers(-2_000_000_000, 2_000_000_000),
    st.integers(4, 40),
)
def test_the_offset_of_a_file_moves_no_point_of_a_metric_grid(scale, size, offset, extent):
    """Points every half voxel, stored as LAS does: integer times scale plus offset."""
    steps = np.arange(0, 2 * extent + 1) * round(size / scale / 2) + round(4_630_000.13 / scale)
    voxels = []
    for shift in (0, offset):
        x = (steps - shift) * scale + shift * scale
        xyz = np.column_stack([x, x, np.zeros(len(x))])
        grid = VoxelGrid.metric(xyz, size)
        assert grid.shape == (1, extent, extent)
        voxels.append(grid.voxel_of(xyz) % extent)
    expected = np.minimum(np.arange(2 * extent + 1) // 2, extent - 1)
    np.testing.assert_array_equal(voxels[0], expected)
    np.testing.assert_array_equal(voxels[1], expected)


@pytest.mark.parametrize(("side", "edge"), [(0.5, "0.0078"), (1e6, "1.6e+04")])
def test_a_cube_of_voxels_far_from_metres_is_refused(side, edge):
    """Its model could not be written: a model file has the size of the voxels."""
    message = f"64 voxels over {side:g} m have edges of {edge} m, which must be 0.01 to 1000 m"
    with pytest.raises(InputError, match=re.escape(message)):
        VoxelGrid.cube(np.array([[0.0, 0, 0], [side, 0, 0]]), 64)


def test_a_single_point_has_a_metric_grid_but_no_cube():
    one = np.array([[500_000.0, 4_630_000.0, 7.0]])
    assert VoxelGrid.metric(one, 0.5).shape == (1, 1, 1)
    with pytest.raises(InputError, match="same coordinates"):
        VoxelGrid.cube(one, 64)


def test_a_stray_point_that_makes_the_grid_too_large_is_refused():
    with pytest.raises(InputError, match=r"a grid over 0 x 0 x 9000 m.*Remove stray points"):
        VoxelGrid.metric(np.array([[0, 0, 0], [0, 0, 9000.0]]), 0.00001)


@pytest.mark.parametrize("settings", [VoxelSettings(), VoxelSettings(fit="metric")])
def test_a_grid_without_points_is_refused(settings):
    with pytest.raises(InputError, match="no points"):
        settings.grid(np.empty((0, 3)))


def test_a_voxel_is_tower_if_any_of_its_points_is():
    points = [[0.1, 0, 0]] * 99 + [[0.2, 0, 0], [1.5, 0, 0]]
    codes = [2] * 99 + [15, 16]  # one tower point among ground; a conductor is not a tower
    sample = voxelise(cloud(points, codes), VoxelGrid((0.0, 0.0, 0.0), 1.0, (1, 1, 3)))
    assert sample.index.tolist() == [0, 1]
    assert sample.count.tolist() == [100, 1]
    assert sample.labelled.tolist() == [True, False]
    assert sample.labelled_index().tolist() == [0]


def test_presence_is_one_and_density_relates_to_the_fullest_voxel():
    points = [[0.5, 0, 0]] * 4 + [[1.5, 0, 0]] + [[2.5, 0, 0]] * 2
    sample = voxelise(cloud(points), VoxelGrid((0.0, 0.0, 0.0), 1.0, (1, 1, 3)))
    assert sample.phi("presence").tolist() == [1.0, 1.0, 1.0]
    assert sample.phi("density").tolist() == [1.0, 0.25, 0.5]
    assert sample.phi("density").dtype == np.float32


def test_labels_of_unknown_meaning_are_refused():
    unnamed = PointCloud(np.zeros((2, 3)), np.full(2, 15, np.uint8))
    with pytest.raises(InputError, match=r"class scheme.*edp, asprs"):
        voxelise(unnamed, VoxelGrid((0.0, 0.0, 0.0), 1.0, (1, 1, 1)))


@given(points_of_any_crop, st.sampled_from([0.3, 1.0, 7.0]), st.randoms())
def test_order_of_points_does_not_matter(xyz, voxel_size, random):
    order = list(range(len(xyz)))
    random.shuffle(order)
    codes = (np.arange(len(xyz)) % 3 * 15).astype(np.uint8)
    grid = VoxelGrid.metric(xyz, voxel_size)
    one = voxelise(PointCloud(xyz, codes, EDP), grid)
    other = voxelise(PointCloud(xyz[order], codes[order], EDP), grid)
    for name in ("index", "count", "labelled"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@given(points_of_any_crop, st.sampled_from([0.3, 1.0, 7.0]))
def test_every_point_lies_in_its_voxel_and_is_counted_once(xyz, voxel_size):
    grid = VoxelGrid.metric(xyz, voxel_size)
    sample = voxelise(cloud(xyz), grid)
    assert sample.count.sum() == len(xyz)
    assert np.all(np.diff(sample.index) > 0)
    off = np.abs(grid.centres(grid.voxel_of(xyz)) - xyz)
    assert off.max() <= voxel_size / 2 + 1e-6


def test_the_cache_returns_what_was_voxelised(tmp_path, scene):
    samples = tmp_path / "samples"
    samples.mkdir()
    clouds = [scene(seed=seed) for seed in range(2)]
    for number, made in enumerate(clouds):
        path = samples / f"sample_{number}.npy"
        np.save(path, np.column_stack([made.xyz, made.classification]))
    towers = survey_towers(samples, "edp", TowerSettings(min_points=100)).towers
    crops, voxels = tmp_path / "crops.json", tmp_path / "voxels.json"
    cut_crops("s", samples, "edp", towers, CropSettings(), tmp_path / "c.zarr.zip", crops)
    settings = VoxelSettings(fit="metric", voxel_size=1.0)
    facts = build(crops, settings, tmp_path / "v.zarr.zip", voxels)

    dataset = load([voxels])
    assert dataset.codes == "edp"
    assert [c.id for c in dataset.crops] == [s.id for s in dataset.samples]
    for sample, made, entry in zip(dataset.samples, clouds, facts["samples"], strict=True):
        expected = voxelise(made, settings.grid(made.xyz), sample.id)
        assert sample.grid == expected.grid
        for name in ("index", "count", "labelled"):
            np.testing.assert_array_equal(getattr(sample, name), getattr(expected, name))
        assert entry["occupied"] == len(expected.index)
        assert entry["tower"] == expected.labelled.sum() > 0
    assert [s.id for s in load([voxels], {"s-sample_1"}).samples] == ["s-sample_1"]
    assert StoreReader(voxels).manifest["grid"] == settings.model_dump()


def test_too_little_space_for_the_voxels_is_said(tmp_path, scene, monkeypatch):
    cloud = scene()
    np.save(tmp_path / "a.npy", np.column_stack([cloud.xyz, cloud.classification]))
    towers = survey_towers(tmp_path / "a.npy", "edp", TowerSettings(min_points=100)).towers
    crops, voxels = tmp_path / "crops.json", tmp_path / "voxels.zarr.zip"
    store = tmp_path / "crops.zarr.zip"
    cut_crops("s", tmp_path / "a.npy", "edp", towers, CropSettings(), store, crops)
    monkeypatch.setattr("scenenet.core.outputs.free_space", lambda path: 1000)
    with pytest.raises(OutputError, match=r"voxels\.zarr\.zip.*MB are needed, and 0\.0 MB"):
        build(crops, VoxelSettings(), voxels, tmp_path / "voxels.json")
    assert not voxels.exists()


PUBLISHED = {  # occupied and tower voxels of the published code at 64^3
    "sample_575": (4244, 78),
    "sample_578": (2191, 82),
    "sample_584": (2249, 127),
    "sample_588": (5073, 84),
    "sample_591": (6124, 119),
    "sample_593": (1156, 66),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_real_crops_have_the_voxels_of_the_published_code(real_samples, name):
    sample = real_samples[name]
    occupied, tower = PUBLISHED[name]
    assert abs(len(sample.index) - occupied) <= 3
    assert abs(int(sample.labelled.sum()) - tower) <= 3


def test_a_voxel_is_true_if_any_of_its_points_is_tower_in_truth(scene, tmp_path):
    made = scene()
    labels = made.classification.copy()
    labels[made.classification == 4] = 15  # the tree is labelled tower
    both = PointCloud(made.xyz, labels, EDP, truth=made.classification)
    grid = VoxelGrid.metric(made.xyz, 1.0)
    sample = voxelise(both, grid)
    np.testing.assert_array_equal(sample.true, voxelise(made, grid).labelled)
    assert 0 < sample.true.sum() < sample.labelled.sum()
    np.testing.assert_array_equal(np.flatnonzero(sample.truth()), sample.index[sample.true])
    assert voxelise(made, grid).true is None and voxelise(made, grid).truth() is None

    # The cache keeps it.
    folders = [tmp_path / "labelled", tmp_path / "true"]
    for folder, codes in zip(folders, (labels, made.classification), strict=True):
        folder.mkdir()
        np.save(folder / "a.npy", np.column_stack([made.xyz, codes]))
    tables = [survey_towers(f, "edp", TowerSettings(min_points=50)).towers for f in folders]
    crops, voxels = tmp_path / "crops.json", tmp_path / "voxels.json"
    cut_crops("s", folders[0], "edp", tables[0], CropSettings(), tmp_path / "c.zarr.zip", crops,
              Truth(folders[1], tables[1]))  # fmt: skip
    build(crops, VoxelSettings(fit="metric", voxel_size=1.0), tmp_path / "v.zarr.zip", voxels)
    [cached] = load([voxels]).samples
    np.testing.assert_array_equal(cached.true, sample.true)
