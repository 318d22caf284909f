"""Square crops for targets other than towers."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.dataset.crops import read_crops
from scenenet.dataset.square_settings import SquareSettings
from scenenet.dataset.squares import cut_squares, require_squares
from scenenet.dataset.voxel_cache import build, load
from scenenet.dataset.voxels import VoxelSettings
from scenenet.pointcloud import PointCloud, class_scheme, write_las
from scenenet.pointcloud.targets import Target

WIRE, GROUND = 16, 2
CORNER = np.array([500_003.0, 4_630_007.0, 80.0])


def field(wires: list[tuple[float, float]]) -> PointCloud:
    """Ground of 60 x 40 m with a point per m^2, and a point on a wire 9 m above each place."""
    x, y = np.meshgrid(np.arange(60.0), np.arange(40.0))
    ground = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    above = np.array([(*wire, 9.0) for wire in wires]).reshape(-1, 3)
    codes = np.repeat([GROUND, WIRE], [len(ground), len(above)]).astype(np.uint8)
    return PointCloud(np.concatenate([ground, above]) + CORNER, codes, class_scheme("edp"))


def cut(path, folder, target="wire", truth=None):
    squares = SquareSettings(edge=20.0)
    facts = cut_squares("s", path, "edp", Target.parse(target), squares,
                        folder / "crops.zarr.zip", folder / "crops.json", truth)  # fmt: skip
    return facts, list(read_crops(folder / "crops.json"))


@pytest.mark.parametrize("chunk", [1000, 1_000_000])
def test_a_square_with_a_labelled_point_is_a_crop_with_all_its_points(tmp_path, chunk, monkeypatch):
    monkeypatch.setattr("scenenet.pointcloud.reading.CHUNK_POINTS", chunk)
    cloud = field([(3.5, 3.5), (5.5, 3.5), (45.5, 20.0)])
    write_las(tmp_path / "s.laz", cloud)
    facts, crops = cut(tmp_path / "s.laz", tmp_path)
    assert [crop.id for crop, _ in crops] == ["s-0001", "s-0002"]
    assert [entry["labelled"] for entry in facts["crops"]] == [2, 1]
    for (crop, points), low in zip(crops, [(0, 0), (40, 20)], strict=True):
        corner = CORNER[:2] + low
        inside = ((cloud.xyz[:, :2] >= corner) & (cloud.xyz[:, :2] < corner + 20)).all(axis=1)
        np.testing.assert_allclose([crop.x, crop.y, crop.radius], [*(corner + 10), 10])
        np.testing.assert_allclose(points.xyz, cloud.xyz[inside], atol=1e-6)
        np.testing.assert_array_equal(points.classification, cloud.classification[inside])
        # A later stage that holds the whole survey finds the same points.
        np.testing.assert_array_equal(crop.inside(cloud.xyz), np.flatnonzero(inside))


def test_a_survey_without_the_target_is_named_with_the_codes_it_has(tmp_path):
    write_las(tmp_path / "s.laz", field([(3.5, 3.5)]))
    facts, crops = cut(tmp_path / "s.laz", tmp_path, "lamp=14")
    assert crops == []
    assert facts["skipped"] == [
        {
            "sample": "s.laz",
            "reason": "no point is labelled lamp (class code 14 in edp); the codes in it are 2, 16",
        }
    ]


def test_an_observer_without_a_point_of_its_target_is_refused(tmp_path):
    write_las(tmp_path / "s.laz", field([(3.5, 3.5)]))
    for target in ("wire", "lamp=14"):
        (tmp_path / target).mkdir()
        cut(tmp_path / "s.laz", tmp_path / target, target)
    without, wires = (tmp_path / target / "crops.json" for target in ("lamp=14", "wire"))
    require_squares([without, wires], "lamps", "lamp=14")
    with pytest.raises(InputError, match="observer lamps has nothing to learn from") as caught:
        require_squares([without, without], "lamps", "lamp=14")
    assert "s.laz: no point is labelled lamp" in str(caught.value)


def test_the_truth_of_a_square_is_that_of_its_points(tmp_path):
    cloud = field([(3.5, 3.5), (5.5, 3.5)])
    true = cloud.classification.copy()
    true[-1] = 5  # a branch
    write_las(tmp_path / "s.laz", cloud)
    write_las(tmp_path / "true.laz", PointCloud(cloud.xyz, true, cloud.scheme))
    facts, _ = cut(tmp_path / "s.laz", tmp_path, truth=tmp_path / "true.laz")
    [entry] = facts["crops"]
    assert (entry["labelled"], entry["wrong"], entry["true_towers"]) == (2, 1, [])


def test_a_ts40k_sample_is_one_crop(tmp_path):
    folder = tmp_path / "samples"
    folder.mkdir()
    for name, wires in (("a", [(3.5, 3.5)]), ("b", [])):
        cloud = field(wires)
        np.save(folder / f"{name}.npy", np.column_stack([cloud.xyz, cloud.classification]))
    facts, [(crop, points)] = cut(folder, tmp_path)
    assert (crop.id, len(points), crop.radius) == ("s-a", 2401, 29.5)
    assert [entry["sample"] for entry in facts["skipped"]] == ["b.npy"]


def test_the_voxels_of_squares_have_the_labels_of_the_target_and_no_tower_shape(tmp_path):
    write_las(tmp_path / "s.laz", field([(3.5, 3.5), (4.5, 3.5), (3.6, 3.6)]))
    cut(tmp_path / "s.laz", tmp_path)
    grid = VoxelSettings(fit="metric", voxel_size=1.0)
    facts = build(tmp_path / "crops.json", grid, tmp_path / "v.zarr.zip", tmp_path / "v.json")
    assert [(e["tower"], e["tower_shape"]) for e in facts["samples"]] == [(2, None)]
    assert load([tmp_path / "v.json"]).target == Target.parse("wire")


def test_voxels_of_several_targets_are_no_dataset(tmp_path):
    write_las(tmp_path / "s.laz", field([(3.5, 3.5)]))
    manifests = []
    for target in ("wire", "ground"):
        folder = tmp_path / target
        folder.mkdir()
        cut(tmp_path / "s.laz", folder, target)
        manifests.append(folder / "v.json")
        build(folder / "crops.json", VoxelSettings(), folder / "v.zarr.zip", manifests[-1])
    with pytest.raises(InputError, match="labels of several targets: ground, wire"):
        load(manifests)
