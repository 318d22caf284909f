"""A whole survey: every point gets its prediction, and the towers are listed."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pyproj
import pytest
import torch

from scenenet.core.errors import InputError
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.tower_ids import tower_ids
from scenenet.models.cnn import CNN
from scenenet.models.factory import new_model
from scenenet.models.model_file import ModelCard, read_model, write_model
from scenenet.models.settings import ModelSettings, TrainingSettings, TuningSettings
from scenenet.pointcloud import PointCloud, read, write_las
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.writers import predict_to_files
from scenenet.training.train import fit
from scenenet.training.tuning import choose

PLACE = np.array([544_000.0, 4_634_000.0, 100.0])
POLE = (500_020.5, 4_630_031.5)
POLE_ID = 1000263003
DUTCH_TOWER_HEIGHT_M = 42.0
LONE_POLES = DetectionSettings(min_conductor=0)
"""For scenes with poles without conductors."""
ADDED = {
    "tower_probability": np.float32,
    "tower_id": np.uint32,
    "share_cylinder": np.float32,
    "share_arrow": np.float32,
    "share_negative_sphere": np.float32,
}
SHARES = [name for name in ADDED if name.startswith("share_")]


@dataclass(frozen=True)
class Prediction:
    """The files that predict_to_files wrote, and the summary that it returned."""

    laz: Path
    towers: dict[str, Any]
    summary: dict[str, Any]

    @property
    def points(self) -> laspy.LasData:
        return laspy.read(self.laz)


def predict(
    survey: Path,
    model: Path,
    folder: Path,
    detection: DetectionSettings = LONE_POLES,
    **settings,
) -> Prediction:
    folder.mkdir(exist_ok=True)
    endings = ("gpkg", "geojson", "csv", "json")
    lists = (folder / f"out.{ending}" for ending in endings)
    files = PredictionFiles({survey: folder / "out.laz"}, *lists)
    predict_with = PredictSettings(**settings)
    returned = predict_to_files(survey, model, files, predict_with, detection).to_json()
    assert json.loads(files.summary.read_text()) == returned
    [points] = files.points.values()
    return Prediction(points, json.loads(files.geojson.read_text()), returned)


def equal_field_by_field(before: laspy.LasData, after: laspy.LasData) -> None:
    """Every dimension of ``before`` is in ``after``: the same stored numbers in the same order."""
    np.testing.assert_array_equal(after.header.scales, before.header.scales)
    np.testing.assert_array_equal(after.header.offsets, before.header.offsets)
    assert after.header.point_count == before.header.point_count
    assert after.header.point_format.id == before.header.point_format.id
    raw_before, raw_after = before.points.array, after.points.array
    assert set(raw_before.dtype.names) <= set(raw_after.dtype.names)
    for name in raw_before.dtype.names:  # X, Y and Z are the stored integers
        np.testing.assert_array_equal(raw_after[name], raw_before[name], err_msg=name)


@pytest.fixture(scope="module")
def survey(scene, tmp_path_factory) -> Path:
    """A pole and a tree on 70 x 60 m of flat ground, with a CRS and a dimension of its own."""
    cloud = scene([(20.5, 31.5)], size=(70.0, 60.0), tree=(45.0, 40.0))
    order = np.random.default_rng(0).permutation(len(cloud))
    cloud = PointCloud(cloud.xyz[order], cloud.classification[order], crs=pyproj.CRS(32629))
    path = tmp_path_factory.mktemp("survey") / "field.laz"
    write_las(path, cloud, extra={"reflectance": np.arange(len(cloud), dtype=np.float32)})
    return path


@pytest.fixture(scope="module")
def predicted(survey, model, tmp_path_factory) -> Prediction:
    return predict(survey, model, tmp_path_factory.mktemp("predicted"))


def test_every_point_keeps_all_its_values(survey, predicted):
    equal_field_by_field(laspy.read(survey), predicted.points)
    assert predicted.points.header.parse_crs() == laspy.read(survey).header.parse_crs()


def test_only_the_predictions_are_added(survey, predicted):
    before, after = laspy.read(survey).point_format, predicted.points.point_format
    added = set(after.dimension_names) - set(before.dimension_names)
    assert added == set(ADDED)
    for name, dtype in ADDED.items():
        assert predicted.points[name].dtype == dtype


def test_the_tower_is_listed_where_it_stands(predicted):
    [tower] = predicted.towers["features"]
    assert tower["geometry"]["type"] == "Point"
    properties = tower["properties"]
    assert (properties["x"], properties["y"]) == pytest.approx(POLE, abs=0.5)
    assert properties["id"] == tower["id"] == POLE_ID
    assert properties["height"] == pytest.approx(14.0, abs=1.0)
    assert properties["base"] == pytest.approx(100.0, abs=1.0)
    assert 0.7 <= properties["probability"] <= 1.0
    assert properties["edge_distance"] == pytest.approx(20.5, abs=2.0)
    assert set(properties["contributions"]) == {"cylinder", "arrow", "negative_sphere"}
    assert sum(map(abs, properties["contributions"].values())) == pytest.approx(1.0, abs=0.05)
    assert set(predicted.towers) == {"type", "features"}
    place = pyproj.Transformer.from_crs(32629, 4326, always_xy=True).transform(*POLE)
    assert tower["geometry"]["coordinates"][:2] == pytest.approx(place, abs=1e-5)
    assert tower["geometry"]["coordinates"][2] == properties["base"]


def test_conductors_are_listed_and_a_lone_pole_is_not_a_tower(scene, model, tmp_path):
    cloud = scene([(20.5, 31.5), (60.5, 31.5)], size=(81.0, 60.0), tree=None)
    s = np.arange(-28, 28, 0.2)
    x, y = POLE
    conductor = np.column_stack([np.full(len(s), x), y + s, 113.8 - s**2 / 1000])
    line = PointCloud(
        np.concatenate([cloud.xyz, conductor]),
        np.append(cloud.classification, np.full(len(conductor), 16, np.uint8)),
    )
    write_las(tmp_path / "line.laz", line)
    found = predict(tmp_path / "line.laz", model, tmp_path / "out", DetectionSettings())
    [tower] = found.towers["features"]
    assert tower["geometry"]["coordinates"][:2] == pytest.approx(POLE, abs=0.6)
    properties = tower["properties"]
    assert properties["conductor_directions"] == 2
    assert sorted(round(b) % 360 for b in properties["conductor_bearings"]) == [0, 180]
    assert 0.4 <= properties["width"] <= 0.8
    assert set(np.unique(found.points["tower_id"])) == {0, POLE_ID}


def test_the_points_of_the_tower_carry_its_number(predicted):
    points = predicted.points
    of_tower = points["tower_id"] == POLE_ID
    assert set(np.unique(points["tower_id"])) == {0, POLE_ID}
    assert of_tower.sum() == predicted.towers["features"][0]["properties"]["points"] > 100
    away = np.hypot(points.x[of_tower] - POLE[0], points.y[of_tower] - POLE[1])
    assert away.max() < 0.6
    # Detected or not: the response at the foot of a pole is low.
    above_foot = np.asarray(points.z) > 102
    pole = (np.asarray(points.classification) == 15) & above_foot
    assert of_tower[pole].all()
    assert (points["tower_probability"][pole] < LONE_POLES.threshold(0.7)).any()


def test_shares_sum_to_one_where_there_is_a_response(predicted):
    points = predicted.points
    shares = np.stack([points[name] for name in SHARES])
    total = np.abs(shares).sum(axis=0)
    assert np.all(np.isclose(total, 1, atol=1e-5) | (total == 0))
    assert np.isclose(total, 1, atol=1e-5).mean() > 0.9
    # In the voxels of a tower, supporting shares outweigh opposing ones.
    sure = points["tower_probability"] > 0
    assert (shares[:, sure].sum(axis=0) > 0).all()
    assert sure.any()


def test_points_of_one_voxel_have_one_prediction(predicted):
    points = predicted.points
    voxels = np.floor(np.column_stack([points.x, points.y, points.z])).astype(int)
    _, voxel = np.unique(voxels, axis=0, return_inverse=True)
    for name in set(ADDED) - {"tower_id"}:  # a voxel may hold a tower and the ground beside it
        values = np.asarray(points[name], float)
        n = np.bincount(voxel)
        spread = np.bincount(voxel, values**2) / n - (np.bincount(voxel, values) / n) ** 2
        assert np.abs(spread).max() < 1e-6


def test_the_summary_describes_the_prediction(predicted, survey):
    summary = predicted.summary
    assert summary["survey"] == str(survey)
    assert summary["points"] == len(laspy.read(survey).points)
    assert summary["towers"] == 1
    assert summary["tau"] == 0.7
    assert summary["voxel_size_m"] == 1.0
    assert summary["kernel_size"] == [9, 9, 9]
    assert summary["settings"]["detection"] == LONE_POLES.model_dump()
    [thin] = summary["warnings"]
    assert "points per m2" in thin


@pytest.mark.parametrize("chunk_points", [997, 10**9])
def test_chunks_do_not_matter(survey, model, predicted, tmp_path, chunk_points):
    again = predict(survey, model, tmp_path, chunk_points=chunk_points)
    assert again.towers == predicted.towers
    assert np.array_equal(again.points.points.array, predicted.points.points.array)


def test_order_of_points_does_not_matter(survey, model, predicted, tmp_path):
    cloud = read(survey)
    order = np.random.default_rng(1).permutation(len(cloud))
    write_las(tmp_path / "mixed.laz", cloud.select(order))
    mixed = predict(tmp_path / "mixed.laz", model, tmp_path / "out")
    assert mixed.towers == predicted.towers
    for name in ADDED:
        np.testing.assert_array_equal(mixed.points[name], predicted.points[name][order])


def test_a_predicted_survey_can_be_predicted_again(predicted, model, tmp_path):
    again = predict(predicted.laz, model, tmp_path)
    assert again.towers == predicted.towers
    assert np.array_equal(again.points.points.array, predicted.points.points.array)


def test_the_voxel_size_can_be_set(survey, model, tmp_path):
    assert predict(survey, model, tmp_path, voxel_size=2.0).summary["voxel_size_m"] == 2.0


def test_a_model_in_metres_observes_fine_voxels_in_blocks(survey, model, tmp_path):
    _, card = read_model(model)
    settings = ModelSettings(name="metric", kind="scenenet", protocol="operational")
    write_model(tmp_path / "metric.json", new_model(settings, 0), card)
    fine = predict(survey, tmp_path / "metric.json", tmp_path, voxel_size=0.3)
    assert fine.summary["voxel_size_m"] == pytest.approx(0.9)
    assert predict(survey, model, tmp_path, voxel_size=0.5).summary["voxel_size_m"] == 0.5


def test_towers_are_numbered_in_the_list_and_in_the_points(scene, model, tmp_path):
    cloud = scene([(15.5, 15.5), (75.5, 15.5), (135.5, 15.5)], size=(151.0, 31.0), tree=None)
    write_las(tmp_path / "line.laz", cloud)
    line = predict(tmp_path / "line.laz", model, tmp_path / "out")
    assert line.towers["coordinates"] == "survey"  # it has no CRS, and none is invented
    places = {f["id"]: f["geometry"]["coordinates"][:2] for f in line.towers["features"]}
    assert sorted(places) == sorted(tower_ids(np.array(list(places.values()))))
    assert set(np.unique(line.points["tower_id"])) == {0, *places}
    assert sorted(round(x - 500_000.5) for x, _ in places.values()) == [15, 75, 135]
    for number, (x, y) in places.items():
        mine = line.points["tower_id"] == number
        assert np.hypot(line.points.x[mine] - x, line.points.y[mine] - y).max() < 2


def test_a_survey_without_points_gives_an_empty_list(model, tmp_path):
    nothing = PointCloud(np.empty((0, 3)), np.empty(0, np.uint8), crs=pyproj.CRS(32629))
    write_las(tmp_path / "empty.laz", nothing)
    empty = predict(tmp_path / "empty.laz", model, tmp_path / "out")
    assert empty.towers["features"] == []
    assert empty.summary["points"] == 0
    assert len(empty.points) == 0
    assert set(ADDED) <= set(empty.points.point_format.dimension_names)


@pytest.mark.parametrize("n", [0, 1])
def test_a_sample_of_hardly_any_points_is_a_survey(model, tmp_path, n):
    np.save(tmp_path / "tiny.npy", np.full((n, 4), 2.0))
    tiny = predict(tmp_path / "tiny.npy", model, tmp_path / "out")
    assert len(tiny.points) == n
    assert tiny.towers["features"] == []


def test_a_sample_comes_back_as_laz(scene, model, tmp_path):
    cloud = scene()
    np.save(tmp_path / "sample.npy", np.column_stack([cloud.xyz, cloud.classification]))
    sample = predict(tmp_path / "sample.npy", model, tmp_path / "out")
    points = sample.points
    xyz = np.column_stack([points.x, points.y, points.z])
    np.testing.assert_allclose(xyz, cloud.xyz, atol=0.0005001)
    np.testing.assert_array_equal(points.classification, cloud.classification)
    assert len(sample.towers["features"]) == 1
    assert (points["tower_id"] == sample.towers["features"][0]["id"]).any()


def test_a_point_outside_the_lattice_is_named_and_nothing_is_written(scene, model, tmp_path):
    cloud = scene()
    xyz = np.concatenate([cloud.xyz, [[5e8, 0, 0]]])
    np.save(tmp_path / "stray.npy", np.column_stack([xyz, np.full(len(xyz), 2.0)]))
    with pytest.raises(InputError, match=r"stray\.npy: the point .* too far from the origin"):
        predict(tmp_path / "stray.npy", model, tmp_path / "out")
    assert list((tmp_path / "out").iterdir()) == []


def test_an_untuned_model_is_refused_before_anything_is_read(pole_finder, tmp_path):
    untuned, card = pole_finder
    write_model(tmp_path / "m.json", untuned, card.model_copy(update={"tau": None}))
    with pytest.raises(InputError, match="no detection threshold"):
        predict(tmp_path / "not-there.laz", tmp_path / "m.json", tmp_path / "out")


def test_a_cnn_gives_probabilities_and_no_shares(survey, pole_finder, tmp_path):
    _, card = pole_finder
    cnn = CNN(2, (5, 5, 5), generator=torch.Generator().manual_seed(0))
    write_model(tmp_path / "cnn.safetensors", cnn, card.with_tau(0.1))
    found = predict(survey, tmp_path / "cnn.safetensors", tmp_path / "out")
    names = set(found.points.point_format.dimension_names)
    assert {"tower_probability", "tower_id"} <= names
    assert not any(name.startswith("share_") for name in names)
    assert (found.points["tower_probability"] > 0).any()
    assert all(f["properties"]["contributions"] == {} for f in found.towers["features"])


@pytest.fixture(scope="module")
def real_model(real_samples, tmp_path_factory) -> Path:
    """A SCENE-Net trained on the real crops, with tau and kernel size tuned on the same crops."""
    samples = list(real_samples.values())
    settings = ModelSettings(
        name="real",
        kind="scenenet",
        kernel_size=(15, 5, 5),
        training=TrainingSettings(epochs=60, learning_rate=0.02),
    )
    trained, _ = fit(samples, [], settings, seed=1)
    voxel_size = float(np.median([s.grid.voxel_size for s in samples]))
    card = ModelCard(
        name="real", codes="edp", measurement="presence", fit="cube", resolution=64,
        voxel_size=voxel_size,
    )  # fmt: skip
    tuned, card, _ = choose(trained, card, samples, TuningSettings(kernel_sizes=((9, 5, 5),)))
    path = tmp_path_factory.mktemp("real") / "real.json"
    write_model(path, tuned, card)
    return path


@pytest.fixture(scope="module")
def real_prediction(real_data, real_model, tmp_path_factory) -> Prediction:
    survey = real_data / "corridor" / "07CZ2_14.laz"
    return predict(survey, real_model, tmp_path_factory.mktemp("corridor"))


def test_a_model_of_portuguese_poles_finds_the_dutch_tower(real_prediction, real_data):
    survey = read(real_data / "corridor" / "07CZ2_14.laz", "asprs")
    labelled = survey.xyz[survey.is_tower]
    true = (labelled[:, :2].min(axis=0) + labelled[:, :2].max(axis=0)) / 2
    features = real_prediction.towers["features"]
    apart = [np.hypot(*(np.array(f["geometry"]["coordinates"][:2]) - true)) for f in features]
    nearest = features[int(np.argmin(apart))]
    assert min(apart) < 5.0
    assert nearest["properties"]["height"] == pytest.approx(DUTCH_TOWER_HEIGHT_M, abs=4.0)
    points = real_prediction.points
    mine = points["tower_id"] == nearest["id"]
    assert np.mean(np.asarray(points.classification)[mine] == 15) > 0.5


def test_a_real_survey_comes_back_field_by_field(real_prediction, real_data):
    before = laspy.read(real_data / "corridor" / "07CZ2_14.laz")
    equal_field_by_field(before, real_prediction.points)
    added = set(real_prediction.points.point_format.dimension_names)
    assert added - set(before.point_format.dimension_names) == set(ADDED)


@pytest.mark.parametrize(("epsg", "reason"), [(4326, "degrees"), (4978, "geocentric")])
def test_a_survey_without_lengths_is_refused(tmp_path, model, epsg, reason):
    """Sizes of voxels and towers are lengths."""
    xyz = np.random.default_rng(0).uniform(0, 80, (50, 3))
    crs = pyproj.CRS.from_epsg(epsg)
    write_las(tmp_path / "far.laz", PointCloud(xyz, np.ones(50, np.uint8), crs=crs))
    with pytest.raises(InputError, match=rf"far\.laz.*{reason}.*Reproject"):
        predict(tmp_path / "far.laz", model, tmp_path / "out")
    assert list((tmp_path / "out").iterdir()) == []


def test_what_looks_wrong_is_in_the_summary_and_on_stderr(scene, model, tmp_path, capsys):
    cloud = scene()
    xyz = cloud.xyz.astype(np.float32).astype(np.float64)
    path = tmp_path / "single.las"
    write_las(path, PointCloud(xyz, cloud.classification, crs=pyproj.CRS(32629)))
    data = path.read_bytes()
    path.write_bytes(data.replace(b"PROJCRS", b"NONSENS"))
    warnings = predict(path, model, tmp_path / "out").summary["warnings"]
    assert [text[:45] for text in warnings] == [
        "the coordinate system (WKT record) cannot be ",
        "the coordinates are rounded as float32 number",
        "there are about 4.3 points per m2. Below 12 t",
    ]
    shown = capsys.readouterr().err
    assert all(f"warning: {path}: {text}" in shown for text in warnings)


@pytest.mark.parametrize("shift", [0.3, 5.0, 5000.0])
@pytest.mark.parametrize("same_number", [True, False])
def test_a_survey_replaced_between_the_passes_leaves_the_earlier_result(
    scene, model, tmp_path, monkeypatch, shift, same_number
):
    from scenenet.prediction import writers

    cloud = scene([(20.5, 15.5)])
    survey, other = tmp_path / "survey.las", tmp_path / "other.las"
    write_las(survey, cloud)
    east = np.array([shift, 0, 0])
    kept = len(cloud) if same_number else len(cloud) - 100
    write_las(other, PointCloud(cloud.xyz[:kept] + east, cloud.classification[:kept]))
    first = predict(survey, model, tmp_path / "out")
    earlier = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    assert first.summary["towers"] == 1
    write = writers.write_file

    def replace_and_write(file, prediction, out):
        other.replace(survey)
        return write(file, prediction, out)

    monkeypatch.setattr(writers, "write_file", replace_and_write)
    with pytest.raises(InputError, match=r"survey\.las: the file was changed, replaced or removed"):
        predict(survey, model, tmp_path / "out")
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == earlier
