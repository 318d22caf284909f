"""Points of the test crops, with the tower ids of a classified survey."""

from __future__ import annotations

import pytest

from scenenet.dataset.crops import CropSettings, Truth, cut_crops, read_crops
from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.dataset.voxel_cache import build
from scenenet.dataset.voxels import VoxelSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.crop_points import count_crop_points
from scenenet.evaluation.result import PointScores
from scenenet.evaluation.scoring import evaluate
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.model_file import write_model
from scenenet.pointcloud import write_las
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.synthetic import SyntheticSettings, make_survey

LONE_POLES = DetectionSettings(min_conductor=0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, pole_finder):
    """Crops, voxels and split of a synthetic line with its truth, and a model."""
    folder = tmp_path_factory.mktemp("crops")
    survey, truth = folder / "line.laz", folder / "line.truth.laz"
    make_survey(SyntheticSettings(towers=3, seed=5, density=20), survey, truth=truth)
    towers, true = (survey_towers(path, "edp", TowerSettings()).towers for path in (survey, truth))
    cut_crops("line", survey, "edp", towers, CropSettings(), folder / "crops.zarr.zip",
              folder / "crops.json", Truth(truth, true))  # fmt: skip
    grid = VoxelSettings(fit="metric", voxel_size=1.0)
    build(folder / "crops.json", grid, folder / "voxels.zarr.zip", folder / "voxels.json")
    rows = ["line,line-0001,train", "line,line-0002,test", "line,line-0003,test"]
    (folder / "split.csv").write_text("\n".join(["survey,crop,part", *rows]))
    write_model(folder / "model.json", *pole_finder)
    return folder


def test_points_of_a_crop_are_those_of_its_classified_survey(folder, tmp_path, capsys):
    model = folder / "model.json"
    found = count_crop_points(model, [folder / "crops.json"], {"line-0001"}, LONE_POLES)
    assert capsys.readouterr().err == "model: points of crops counted: done (1)\n"
    crop, cloud = next(read_crops(folder / "crops.json"))
    assert set(found) == {crop.id}
    write_las(tmp_path / "crop.laz", cloud)
    with predict_survey(tmp_path / "crop.laz", model, PredictSettings(), LONE_POLES) as prediction:
        in_tower = prediction.look_up(cloud.xyz).tower_id > 0
    assert in_tower.sum() > 100
    counts = found[crop.id]
    # The survey has coordinates in steps of a millimetre, which moves few points to other voxels.
    assert counts.labels.tp + counts.labels.fp == pytest.approx(in_tower.sum(), rel=0.02)
    assert counts.labels.tp == pytest.approx((in_tower & cloud.is_tower).sum(), rel=0.02)
    assert counts.truth.tp == pytest.approx((in_tower & cloud.is_true_tower).sum(), rel=0.02)
    assert counts.labels_against_truth == Confusion.of(cloud.is_tower, cloud.is_true_tower)


def test_the_test_part_is_scored_against_labels_and_truth(folder):
    model, manifests = folder / "model.json", [folder / "crops.json"]
    result = evaluate(
        model, [folder / "voxels.json"], folder / "split.csv", LONE_POLES, crop_manifests=manifests
    )
    counts = count_crop_points(model, manifests, {"line-0002", "line-0003"}, LONE_POLES)
    total = counts["line-0002"] + counts["line-0003"]
    assert result.points == PointScores.of(total.labels)
    assert result.truth.points == PointScores.of(total.truth)
    assert result.labels_against_truth == PointScores.of(total.labels_against_truth)
    assert [row.points for row in result.truth.per_sample] == [
        PointScores.of(counts[name].truth) for name in ("line-0002", "line-0003")
    ]
    assert result.truth.voxel.n_samples == result.voxel.n_samples == 2
    assert result.truth.towers.n_true == result.towers.n_true == 2
    assert result.truth.towers.median_height_error_m is not None
    assert result.leading is result.truth


def test_without_the_points_of_the_crops_there_are_no_scores_of_points(folder):
    voxels = [folder / "voxels.json"]
    result = evaluate(folder / "model.json", voxels, folder / "split.csv", LONE_POLES)
    assert result.points is None and result.truth.points is None
    assert result.truth.voxel.n_samples == 2
    assert result.labels_against_truth is None
