"""Choices on the validation part, and the answer there."""

from __future__ import annotations

import pytest

from scenenet.core.errors import InputError
from scenenet.core.files import read_json
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.scoring import evaluate
from scenenet.evaluation.tune import tune
from scenenet.models.factory import new_model
from scenenet.models.model_file import read_model, write_model
from scenenet.models.settings import MetricSettings, ModelSettings, TuningSettings
from scenenet.training.tuning_result import Tuning

LONE_POLES = DetectionSettings(min_conductor=0)


def tuned(model, card, dataset_files, folder):
    write_model(folder / "m.json", model, card.model_copy(update={"tau": None}))
    return tune(
        folder / "m.json", [dataset_files.voxels], [dataset_files.crops], dataset_files.split,
        TuningSettings(), LONE_POLES, folder / "tuned.json", folder / "tuning.json",
    )  # fmt: skip


def test_tuning_only_uses_validation_crops(dataset_files, pole_finder, tmp_path):
    model, card = pole_finder
    result = tuned(model, card, dataset_files, tmp_path)
    assert result.validation.n_samples == 1
    written = read_json(tmp_path / "tuning.json")
    assert Tuning.from_json(written) == result and written == result.to_json()
    (tried,) = written["kernel_sizes"]
    assert tried == {"kernel_size": written["kernel_size"]} | {
        name: value for name, value in written["validation"].items() if name != "n_samples"
    }
    assert read_model(tmp_path / "tuned.json")[1].tau == result.tau
    assert result.whole_towers is None


@pytest.mark.parametrize("whole", [True, False])
def test_a_model_that_gives_whole_towers_is_scored_by_them(
    whole, dataset_files, pole_finder, tmp_path
):
    _, card = pole_finder
    settings = ModelSettings(
        name="m", kind="scenenet", protocol="operational", metric=MetricSettings(whole_towers=whole)
    )
    result = tuned(new_model(settings, 0), card, dataset_files, tmp_path)
    given = evaluate(
        tmp_path / "tuned.json", [dataset_files.voxels], [dataset_files.crops],
        dataset_files.split, LONE_POLES, "validation",
    )  # fmt: skip
    assert result.whole_towers == (given.voxel if whole else None)
    assert result.decisive == (given.voxel.f05 or 0.0, given.voxel_observer.f05 or 0.0)


def test_without_crops_whole_towers_are_not_scored(dataset_files, pole_finder, tmp_path):
    write_model(tmp_path / "m.json", *pole_finder)
    files = tmp_path / "m.json", [dataset_files.voxels]
    found = evaluate(*files, [], dataset_files.split, LONE_POLES)
    full = evaluate(*files, [dataset_files.crops], dataset_files.split, LONE_POLES)
    assert (found.voxel, found.voxel_occupied) == (full.voxel, full.voxel_occupied)
    assert found.points is None and full.points is not None
    assert found.voxel_towers.f05 is None and full.voxel_towers.f05 > 0
    assert (found.towers.precision, found.towers.n_true) == (None, 0)


def test_whole_towers_of_a_model_cannot_be_scored_without_crops(
    dataset_files, pole_finder, tmp_path
):
    settings = ModelSettings(name="m", kind="scenenet", protocol="operational")
    card = pole_finder[1].model_copy(update={"name": "m"})
    write_model(tmp_path / "m.json", new_model(settings, 0), card)
    with pytest.raises(InputError, match="m gives whole towers, which need the crops"):
        evaluate(tmp_path / "m.json", [dataset_files.voxels], [], dataset_files.split, LONE_POLES)
