"""Crops: the surroundings of each tower."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from scenenet.core.errors import InputError, OutputError
from scenenet.dataset import crops as crops_module
from scenenet.dataset.crops import CropSettings, CropSpace, Truth, cut_crops, read_crops
from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.pointcloud import PointCloud, class_scheme, iter_chunks, read, write_las
from scenenet.synthetic import SyntheticSettings, make_survey

ORIGIN = np.array([500_000.0, 4_630_000.0, 0.0])
PLACE = np.array([500_030.0, 4_630_020.0])


def table(*towers: tuple[float, float, float]) -> pd.DataFrame:
    """A table of towers at (x, y) from ``ORIGIN`` with a height."""
    xy = np.array([t[:2] for t in towers]) + ORIGIN[:2]
    heights = [t[2] for t in towers]
    numbers = np.arange(1, len(towers) + 1)
    return pd.DataFrame(
        {"tower": numbers, "x": xy[:, 0], "y": xy[:, 1], "top": heights, "height": heights}
    )


@pytest.fixture
def field(tmp_path):
    """A survey of 60 x 40 m with one point per m^2, and its cloud."""
    x, y = np.meshgrid(np.arange(60.0), np.arange(40.0))
    xyz = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) + ORIGIN
    codes = np.random.default_rng(0).integers(0, 20, len(xyz)).astype(np.uint8)
    cloud = PointCloud(xyz, codes, class_scheme("edp"))
    write_las(tmp_path / "field.laz", cloud)
    return tmp_path / "field.laz", cloud


def cut(path, towers, folder, **settings):
    facts = cut_crops(
        "field",
        path,
        "edp",
        towers,
        CropSettings(**settings),
        folder / "crops.zarr.zip",
        folder / "manifest.json",
    )
    return facts, list(read_crops(folder / "manifest.json"))


def test_a_crop_has_every_point_within_one_tower_height_and_no_other(field, tmp_path):
    path, cloud = field
    _, [(crop, cropped)] = cut(path, table((30, 20, 10.0)), tmp_path)
    apart = np.linalg.norm(cloud.xyz[:, :2] - PLACE, axis=1)
    expected = cloud.select(apart <= 10.0)
    assert len(expected) == 317  # points of a square lattice within a circle of radius 10
    np.testing.assert_allclose(cropped.xyz, expected.xyz, atol=1e-6)
    np.testing.assert_array_equal(cropped.classification, expected.classification)
    assert crop.id == "field-0001"
    assert (crop.x, crop.y, crop.radius) == (500_030.0, 4_630_020.0, 10.0)


def test_the_radius_is_given_in_tower_heights(field, tmp_path):
    _, [(crop, cropped)] = cut(field[0], table((30, 20, 10.0)), tmp_path, radius_in_heights=0.5)
    assert crop.radius == 5.0
    assert len(cropped) == 81


def test_crops_do_not_depend_on_the_chunks_a_survey_is_read_in(field, tmp_path, monkeypatch):
    towers = table((10, 20, 8.0), (40, 10, 12.0))
    (tmp_path / "small").mkdir()
    whole, _ = cut(field[0], towers, tmp_path)
    monkeypatch.setattr(
        crops_module,
        "iter_chunks",
        lambda path, codes, truth, fields: iter_chunks(path, codes, 137, truth, fields),
    )
    pieces, _ = cut(field[0], towers, tmp_path / "small")
    assert pieces == whole
    manifests = [tmp_path / "manifest.json", tmp_path / "small" / "manifest.json"]
    for (_, a), (_, b) in zip(*map(read_crops, manifests), strict=True):
        np.testing.assert_array_equal(a.xyz, b.xyz)


def test_a_crop_lists_all_towers_in_it(field, tmp_path):
    _, crops = cut(field[0], table((20, 20, 15.0), (30, 20, 5.0), (50, 20, 5.0)), tmp_path)
    assert [len(crop.towers) for crop, _ in crops] == [2, 1, 1]
    np.testing.assert_array_equal(
        crops[0][0].towers[:, :2], ORIGIN[:2] + np.array([[20, 20], [30, 20]])
    )


def test_a_survey_without_towers_gives_an_empty_store(field, tmp_path):
    towers = survey_towers(field[0], "edp", TowerSettings(min_points=100_000)).towers
    facts, crops = cut(field[0], towers, tmp_path)
    assert facts["crops"] == crops == []


def test_too_little_space_for_a_store_is_said_before_the_survey_is_read(
    field, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr("scenenet.core.outputs.free_space", lambda path: 50_000)
    with pytest.raises(OutputError, match=r"crops\.zarr\.zip.*0\.1 MB are needed, and 0\.1 MB"):
        cut(field[0], table((30, 20, 10.0)), tmp_path)
    assert "chunks read" not in capsys.readouterr().err
    assert not (tmp_path / "crops.zarr.zip").exists()


def test_the_estimate_of_space_holds_the_crops_and_is_not_far_above(tmp_path, scene):
    samples = tmp_path / "samples"
    samples.mkdir()
    cloud = scene()
    np.save(samples / "a.npy", np.column_stack([cloud.xyz, cloud.classification]))
    write_las(tmp_path / "a.laz", cloud)
    for path in (samples, tmp_path / "a.laz"):
        towers = survey_towers(path, "edp", TowerSettings(min_points=100)).towers
        cut(path, towers, tmp_path)
        written = (tmp_path / "crops.zarr.zip").stat().st_size
        assert written <= CropSpace.of(path).stored <= 5 * written


def test_samples_are_copied_unchanged(tmp_path, scene):
    folder = tmp_path / "samples"
    folder.mkdir()
    clouds = {"sample_1": scene(seed=1), "sample_2": scene(seed=2), "sample_3": scene(poles=())}
    for name, cloud in clouds.items():
        np.save(folder / f"{name}.npy", np.column_stack([cloud.xyz, cloud.classification]))
    towers = survey_towers(folder, "edp", TowerSettings(min_points=100)).towers
    facts, crops = cut(folder, towers, tmp_path)
    assert [crop.id for crop, _ in crops] == ["field-sample_1", "field-sample_2"]
    np.testing.assert_array_equal(crops[0][1].xyz, clouds["sample_1"].xyz)
    np.testing.assert_array_equal(crops[0][1].classification, clouds["sample_1"].classification)
    assert crops[0][0].radius == pytest.approx(14, abs=0.1)
    assert facts["skipped"] == [{"sample": "sample_3.npy", "reason": "it has no labelled tower"}]


def true_survey(folder, towers=3):
    """A synthetic survey with its truth, and the tables of its labelled and its true towers."""
    labelled, truth = folder / "line.laz", folder / "line.truth.laz"
    make_survey(SyntheticSettings(towers=towers, seed=5), labelled, truth=truth)
    tables = [survey_towers(path, "edp", TowerSettings()).towers for path in (labelled, truth)]
    return labelled, truth, *tables


def test_crops_keep_the_truth_of_every_point_and_the_true_towers(tmp_path):
    labelled, truth, towers, true_towers = true_survey(tmp_path)
    cut_crops(
        "line", labelled, "edp", towers, CropSettings(), tmp_path / "crops.zarr.zip",
        tmp_path / "m.json", Truth(truth, true_towers),
    )  # fmt: skip
    whole, true = read(labelled), read(truth)
    crops = list(read_crops(tmp_path / "m.json"))
    assert len(crops) == 3
    for crop, cloud in crops:
        inside = np.hypot(*(whole.xyz[:, :2] - [crop.x, crop.y]).T) <= crop.radius
        np.testing.assert_array_equal(cloud.classification, whole.classification[inside])
        np.testing.assert_array_equal(cloud.truth, true.classification[inside])
        assert 0 < cloud.is_true_tower.sum() < cloud.is_tower.sum()
        apart = np.hypot(true_towers["x"] - crop.x, true_towers["y"] - crop.y)
        near = true_towers[apart <= crop.radius]
        np.testing.assert_array_equal(crop.true_towers[:, :2], near[["x", "y"]])
        np.testing.assert_allclose(crop.true_towers[:, 2:].sum(axis=1), near["top"])
        assert len(crop.towers) == len(crop.true_towers) == 1


def test_without_truth_a_crop_has_none(field, tmp_path):
    _, [(crop, cloud)] = cut(field[0], table((30, 20, 10.0)), tmp_path)
    assert crop.true_towers is None and cloud.truth is None


def test_samples_have_the_truth_of_the_sample_of_the_same_name(scene, tmp_path):
    samples, true = tmp_path / "samples", tmp_path / "true"
    for folder in (samples, true):
        folder.mkdir()
    for number in range(2):
        cloud = scene([(15.5, 15.5)], seed=number)
        codes = cloud.classification.copy()
        np.save(true / f"{number}.npy", np.column_stack([cloud.xyz, codes]))
        codes[codes == 4] = 15  # the tree is labelled tower
        np.save(samples / f"{number}.npy", np.column_stack([cloud.xyz, codes]))
    towers, true_towers = (
        survey_towers(path, "edp", TowerSettings(min_points=50)).towers for path in (samples, true)
    )
    cut_crops(
        "s", samples, "edp", towers, CropSettings(), tmp_path / "crops.zarr.zip",
        tmp_path / "m.json", Truth(true, true_towers),
    )  # fmt: skip
    for number, (crop, cloud) in enumerate(read_crops(tmp_path / "m.json")):
        assert crop.id == f"s-{number}"
        np.testing.assert_array_equal(cloud.truth, np.load(true / f"{number}.npy")[:, 3])
        np.testing.assert_allclose(crop.true_towers[:, 3], [14.0], atol=0.1)
    (true / "1.npy").rename(true / "2.npy")
    with pytest.raises(InputError, match=r"true/1\.npy"):
        cut_crops(
            "s", samples, "edp", towers, CropSettings(), tmp_path / "crops.zarr.zip",
            tmp_path / "m.json", Truth(true, true_towers),
        )  # fmt: skip
