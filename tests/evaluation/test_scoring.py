"""Scores of a model on crops, with models and crops of known outcome."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from scenenet.core.errors import InputError
from scenenet.dataset.crops import Crop, CropClouds, CropSettings, Truth, cut_crops
from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.dataset.voxel_cache import Dataset, build
from scenenet.dataset.voxels import VoxelGrid, VoxelSample, VoxelSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.answers import Answer
from scenenet.evaluation.points import PointCounts
from scenenet.evaluation.result import Evaluation, PointScores
from scenenet.evaluation.scoring import evaluate, score, score_predictions
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.base import VoxelModel
from scenenet.models.factory import new_model
from scenenet.models.model_file import ModelCard, write_model
from scenenet.models.settings import MetricSettings, ModelSettings
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.synthetic import SyntheticSettings, make_survey

SHAPE = (12, 3, 30)
GRID = VoxelGrid((0.0, 0.0, 0.0), 1.0, SHAPE)
LONE_POLES = DetectionSettings(min_conductor=0)
"""For scenes with poles without conductors."""
CARD = ModelCard(
    name="given", codes="edp", measurement="presence", fit="metric", resolution=64, voxel_size=1.0,
    tau=0.5, provenance={"seed": 4},
)  # fmt: skip


class Given(VoxelModel):
    """A model that predicts given probabilities for every crop."""

    kind = "given"
    kernel_size = (1, 1, 1)

    def __init__(self, *probabilities: dict[tuple[int, int, int], float]) -> None:
        super().__init__()
        self.probabilities = iter(probabilities)

    def observer(self):
        raise NotImplementedError

    def forward(self, occupancy):
        volume = torch.zeros((1, *SHAPE))
        for (z, y, x), probability in next(self.probabilities).items():
            volume[0, z, y, x] = probability
        return volume


def pole(x: int, probability: float = 1.0, low: int = 0, high: int = 12):
    return {(z, 1, x): probability for z in range(low, high)}


def crop(number: int, *xs: int, empty=()):
    """A crop with true poles at ``xs`` on a strip of ground, all of it occupied but ``empty``."""
    occupied = {(0, 1, x) for x in range(30)} | {v for x in xs for v in pole(x)}
    occupied |= {v for x in (5, 15, 25) for v in pole(x)}
    true = {v for x in xs for v in pole(x)}
    places = sorted(np.ravel_multi_index(v, SHAPE) for v in occupied - set(empty))
    truth = {np.ravel_multi_index(v, SHAPE) for v in true}
    index = np.array(places, np.int32)
    sample = VoxelSample(
        f"crop-{number}", GRID, index, np.ones_like(index), np.array([i in truth for i in places])
    )
    towers = np.array([[x + 0.5, 1.5] for x in xs]).reshape(-1, 2)
    return sample, Crop(sample.id, 15.0, 1.5, 15.0, towers)


def nothing(sample: VoxelSample) -> Answer:
    """The answer without towers."""
    return Answer(PointCounts(), np.empty(0, np.int64), np.empty((0, 4)))


def towers_at(*xs: int):
    """The answer with a tower at each of ``xs``."""
    voxels = sorted(np.ravel_multi_index(v, SHAPE) for x in xs for v in pole(x))
    places = np.array([[x + 0.5, 1.5, np.nan, np.nan] for x in xs]).reshape(-1, 4)
    return lambda sample: Answer(PointCounts(), np.array(voxels, np.int64), places)


def scores(model: Given, *crops, tau: float = 0.5, answer=nothing):
    samples, of_samples = zip(*crops, strict=True)
    dataset = Dataset(list(samples), list(of_samples), "edp", [])
    return score(model, CARD.with_tau(tau), dataset, answer)


def test_a_perfect_model_scores_one():
    result = scores(
        Given(pole(5), pole(15)), crop(1, 5), crop(2, 15),
        answer=lambda sample: towers_at({"crop-1": 5, "crop-2": 15}[sample.id])(sample),
    )  # fmt: skip
    for name in ("precision", "recall", "f05", "iou_tower", "miou"):
        assert getattr(result.voxel, name) == 1.0
    assert result.to_json()["towers"] == {
        "precision": 1.0, "recall": 1.0, "median_error_m": 0.0, "median_height_error_m": None,
        "median_base_error_m": None, "n_true": 2, "n_predicted": 2,
    }  # fmt: skip
    assert result.average_precision == 1.0
    assert result.alive is True
    assert (result.model, result.seed) == ("given", 4)
    assert result.voxel.n_samples == 2
    assert result.voxel.tau == 0.5


def test_scores_follow_from_the_counts_of_all_crops():
    # crop 1: 12 of 12 tower voxels; crop 2: 12 false ones, 12 missed
    result = scores(Given(pole(5), pole(25)), crop(1, 5), crop(2, 15))
    assert result.voxel.precision == 0.5
    assert result.voxel.recall == 0.5
    assert result.voxel.iou_tower == pytest.approx(12 / 36)
    volume = 2 * np.prod(SHAPE)
    assert result.voxel.miou == pytest.approx((12 / 36 + (volume - 36) / (volume - 12)) / 2)
    assert [(s.tp, s.fp, s.fn) for s in result.per_sample] == [(12, 0, 0), (0, 12, 12)]
    assert [s.f05 for s in result.per_sample] == [1.0, 0.0]


def test_a_model_without_detections_scores_like_the_trivial_one():
    result = scores(Given({}), crop(1, 5))
    assert result.voxel == result.voxel_trivial
    assert result.voxel.miou == pytest.approx(0.5, abs=0.01)
    assert result.voxel.iou_tower == 0.0
    assert result.alive is False
    assert result.towers.median_error_m is None
    assert result.per_sample[0].position_error_m is None


def test_empty_voxels_count_except_in_the_occupied_scores():
    ghost = {(z, 2, 20): 1.0 for z in range(4)}  # where there is no point
    result = scores(Given(pole(5) | ghost), crop(1, 5))
    assert result.voxel.precision == 12 / 16
    assert result.voxel_occupied.precision == 1.0


def test_a_voxel_at_tau_is_detected():
    assert scores(Given(pole(5, 0.3)), crop(1, 5), tau=0.3).voxel.recall == 1.0
    assert scores(Given(pole(5, 0.299)), crop(1, 5), tau=0.3).voxel.recall == 0.0


def test_a_detected_tower_far_from_every_labelled_one_is_false():
    result = scores(Given({}), crop(1, 5, 25), answer=towers_at(5, 15))
    assert result.to_json()["towers"] == {
        "precision": 0.5, "recall": 0.5, "median_error_m": 0.0, "median_height_error_m": None,
        "median_base_error_m": None, "n_true": 2, "n_predicted": 2,
    }  # fmt: skip
    [sample] = result.per_sample
    assert (sample.towers_true, sample.towers_predicted) == (2, 2)


def test_the_curve_of_all_crops_has_the_scores_at_tau():
    result = scores(Given(pole(5, 0.8) | pole(15, 0.6)), crop(1, 5), tau=0.7)
    curve = result.pr_curve
    tau = np.array(curve["tau"])
    both, one, none = tau < 0.6, (tau > 0.61) & (tau < 0.79), tau > 0.81
    for seen, precision, recall in ((both, 0.5, 1.0), (one, 1.0, 1.0), (none, 0.0, 0.0)):
        assert seen.sum() > 10
        assert set(np.array(curve["precision"])[seen]) == {precision}
        assert set(np.array(curve["recall"])[seen]) == {recall}
    assert (result.voxel.precision, result.voxel.recall) == (1.0, 1.0)


def test_scores_are_plain_numbers():
    result = scores(Given(pole(5)), crop(1, 5))
    assert json.loads(json.dumps(result.to_json(), allow_nan=False)) == result.to_json()
    assert Evaluation.from_json(result.to_json()) == result


def test_a_model_without_tau_cannot_be_scored():
    untuned = CARD.model_copy(update={"tau": None})
    with pytest.raises(InputError, match="no detection threshold"):
        score(Given(), untuned, Dataset([], [], "edp", []), nothing)


def test_only_the_selected_part_is_scored(dataset_files, pole_finder, tmp_path):
    write_model(tmp_path / "m.json", *pole_finder)
    found = {
        part: evaluate(
            tmp_path / "m.json",
            [dataset_files.voxels],
            [dataset_files.crops],
            dataset_files.split,
            LONE_POLES,
            part,
        )
        for part in ("train", "validation", "test")
    }
    assert {p: r.voxel.n_samples for p, r in found.items()} == {
        "train": 2, "validation": 1, "test": 3,
    }  # fmt: skip
    assert all(result.part == part for part, result in found.items())
    towers = found["test"].towers
    assert (towers.n_true, towers.recall, towers.precision) == (3, 1.0, 1.0)
    assert towers.median_error_m < 1.0


def test_detected_towers_count_whole_and_other_voxels_do_not():
    """Half of a pole and a low stump reach tau; only the pole is a tower."""
    half = pole(5, low=6) | pole(20, low=0, high=2)
    samples, crops = zip(crop(1, 5), strict=True)
    dataset = Dataset(list(samples), list(crops), "edp", [])

    def predict(sample):
        volume = np.zeros(SHAPE, np.float32)
        for place, probability in half.items():
            volume[place] = probability
        return volume.reshape(-1), sample.labels()

    def counted(**how):
        return score_predictions("m", 0, 0.5, predict, dataset, towers_at(5), **how)

    observer, towers = counted(), counted(whole_towers=True)
    assert observer.voxel == observer.voxel_observer == towers.voxel_observer
    assert towers.voxel == towers.voxel_towers == observer.voxel_towers
    assert (observer.voxel.recall, observer.voxel.precision) == (6 / 12, 6 / 8)
    assert (towers.voxel.recall, towers.voxel.precision) == (1.0, 1.0)
    [sample] = towers.per_sample
    assert (sample.tp, sample.fp, sample.fn) == (12, 0, 0)
    assert sample.f05_observer < sample.f05_towers == sample.f05


@pytest.mark.parametrize("whole", [True, False])
def test_a_model_in_metres_predicts_whole_towers_by_default(whole):
    settings = ModelSettings(
        name="m", kind="scenenet", protocol="operational", metric=MetricSettings(whole_towers=whole)
    )
    result = score(new_model(settings, 0), CARD, Dataset([], [], "edp", []), nothing)
    assert result.whole_towers is whole


def with_truth(number: int, labelled: tuple[int, ...], true: tuple[int, ...]):
    """A crop with poles labelled at ``labelled`` that stand at ``true``."""
    sample, of_sample = crop(number, *labelled)
    standing, of_standing = crop(number, *true)
    np.testing.assert_array_equal(sample.index, standing.index)
    return (
        replace(sample, true=standing.labelled),
        replace(of_sample, true_towers=of_standing.towers),
    )


def test_every_score_is_given_against_the_labels_and_against_the_truth():
    """The model finds the pole at 5 and none other; the label at 15 is wrong."""
    found = scores(
        Given(pole(5), pole(5)),
        with_truth(1, (5, 15), (5,)),
        crop(2, 15),
        answer=towers_at(5),
    )
    assert (found.voxel.precision, found.voxel.recall) == (0.5, pytest.approx(1 / 3))
    assert found.voxel.n_samples == 2
    truth = found.truth
    assert truth is found.leading
    assert truth.voxel.n_samples == 1  # the second crop has no truth
    for scored in (truth.voxel, truth.voxel_observer, truth.voxel_occupied):
        assert (scored.precision, scored.recall, scored.f05) == (1.0, 1.0, 1.0)
    assert truth.average_precision == 1.0 > found.average_precision
    assert (truth.towers.recall, truth.towers.n_true) == (1.0, 1)
    assert (found.towers.recall, found.towers.n_true) == (pytest.approx(1 / 3), 3)
    assert [(s.id, s.tp, s.fn, s.towers_true) for s in truth.per_sample] == [("crop-1", 12, 0, 1)]
    assert Evaluation.from_json(json.loads(json.dumps(found.to_json()))) == found


def test_without_a_known_truth_there_are_no_scores_against_it():
    found = scores(Given(pole(5)), crop(1, 5))
    assert found.truth is None and found.labels_against_truth is None
    assert found.leading is found
    assert found.to_json()["truth"] is None


def test_points_of_crops_are_summed_against_labels_and_truth():
    points = {
        "crop-1": PointCounts(
            Confusion(4, 1, 5, 10), Confusion(3, 2, 0, 15), Confusion(3, 6, 0, 11)
        ),
        "crop-2": PointCounts(Confusion(0, 5, 0, 20)),
    }
    samples, crops = zip(with_truth(1, (5, 15), (5,)), crop(2, 15), strict=True)
    dataset = Dataset(list(samples), list(crops), "edp", [])
    found = score(
        Given(pole(5), pole(5)), CARD, dataset,
        lambda sample: replace(nothing(sample), points=points[sample.id]),
    )  # fmt: skip
    assert found.points == PointScores(4 / 10, 4 / 9, 4 / 15, n_true=9, n_predicted=10, n_points=45)
    assert found.truth.points == PointScores(
        3 / 5, 1.0, 3 / 5, n_true=3, n_predicted=5, n_points=20
    )
    assert found.labels_against_truth == PointScores(
        3 / 9, 1.0, 3 / 9, n_true=3, n_predicted=9, n_points=20
    )
    trivial = found.points.of_every_point
    assert (trivial.precision, trivial.recall, trivial.iou) == (9 / 45, 1.0, 9 / 45)
    assert [s.points.n_predicted for s in found.per_sample] == [5, 5]
    assert found.per_sample[1].points.recall is None  # nothing is labelled


@pytest.fixture(scope="module")
def line(tmp_path_factory, pole_finder):
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


def test_each_crop_of_the_test_part_is_scored_as_a_survey_of_its_own(line, tmp_path):
    model = line / "model.json"
    result = evaluate(
        model, [line / "voxels.json"], [line / "crops.json"], line / "split.csv", LONE_POLES
    )
    total = PointCounts()
    for name, cloud in CropClouds([line / "crops.json"]).items():
        if name == "line-0001":
            continue
        np.save(tmp_path / "crop.npy", np.column_stack([cloud.xyz, cloud.classification]))
        files = tmp_path / "crop.npy", model
        with predict_survey(*files, PredictSettings(), LONE_POLES) as prediction:
            in_tower = prediction.look_up(cloud.xyz).tower_id > 0
        assert in_tower.sum() > 100
        total += PointCounts.of(cloud, in_tower)
    assert result.points == PointScores.of(total.labels)
    assert result.truth.points == PointScores.of(total.truth)
    assert result.labels_against_truth == PointScores.of(total.labels_against_truth)
    assert result.truth.voxel.n_samples == result.voxel.n_samples == 2
    assert result.truth.towers.n_true == result.towers.n_true == 2
    assert result.truth.towers.median_height_error_m is not None
    assert result.leading is result.truth
