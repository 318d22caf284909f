"""Choices on the validation part: tau, the kernel size, the champion."""

from __future__ import annotations

import json

import pytest

from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.metrics.threshold_curve import THRESHOLDS
from scenenet.metrics.voxel_scores import VoxelScores, confusion
from scenenet.models.cnn import CNN
from scenenet.models.model_file import write_model
from scenenet.models.predictions import probabilities
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import TuningSettings
from scenenet.training.champion import champion
from scenenet.training.tuning import choose
from scenenet.training.tuning_result import Tuning


@pytest.fixture(scope="module")
def crops(scene):
    clouds = [scene(((10.5, 12.5),), size=(22, 22), tree=(5, 5 + i), seed=i) for i in range(2)]
    return [voxelise(c, VoxelGrid.metric(c.xyz, 1.0), f"crop-{i}") for i, c in enumerate(clouds)]


def f05_at(model, crops, tau: float) -> float:
    each = (probabilities(model, crop, "presence") for crop in crops)
    one, other = (confusion(probability, truth, tau) for probability, truth in each)
    return (one + other).f05


def test_tau_is_where_f05_is_highest_on_validation(pole_finder, crops):
    model, card = pole_finder
    _, tuned, result = choose(model, card, crops, TuningSettings())
    assert tuned.tau == result.tau
    assert result.validation.f05 == pytest.approx(f05_at(model, crops, tuned.tau))
    for tau in THRESHOLDS[::40]:
        assert f05_at(model, crops, tau) <= result.validation.f05
    assert max(result.curve["f05"]) == result.validation.f05
    assert result.curve["tau"] == THRESHOLDS.tolist()
    assert result.validation.n_samples == 2


def test_the_better_kernel_size_is_chosen(pole_finder, crops):
    model, card = pole_finder
    flat = model.with_kernel_size((1, 3, 3))  # does not respond to vertical objects
    settings = TuningSettings(kernel_sizes=((1, 3, 3), (9, 9, 9)))
    chosen, _, result = choose(flat, card, crops, settings)
    assert chosen.kernel_size == (9, 9, 9)
    assert result.kernel_size == (9, 9, 9)
    tried = {entry.kernel_size: entry.scores.f05 for entry in result.kernel_sizes}
    assert list(tried) == [(1, 3, 3), (9, 9, 9)]
    assert tried[9, 9, 9] == result.validation.f05 > tried[1, 3, 3]
    assert chosen.shape_parameters() == model.shape_parameters()


def test_the_size_it_was_trained_with_wins_a_tie(crops, pole_finder):
    _, card = pole_finder
    blind = SceneNet(["cylinder"], (1, 1, 1))  # one voxel less its own mean: all zero
    settings = TuningSettings(kernel_sizes=((1, 1, 1), (3, 1, 1)))
    chosen, tuned, result = choose(blind, card, crops, settings)
    assert chosen.kernel_size == (1, 1, 1)
    assert result.validation.f05 == 0
    assert tuned.tau == THRESHOLDS[-1]


def test_a_cnn_has_no_other_size(crops, pole_finder):
    _, card = pole_finder
    settings = TuningSettings(kernel_sizes=((3, 3, 3),))
    _, _, result = choose(CNN(1, (5, 5, 5)), card, crops, settings)
    assert [entry.kernel_size for entry in result.kernel_sizes] == [(5, 5, 5)]


def test_the_champion_is_the_best_on_validation(tmp_path, pole_finder):
    model, card = pole_finder
    models, tunings = [], []
    for seed, f05 in enumerate([0.2, 0.6, 0.6, 0.1]):
        models.append(tmp_path / f"seed-{seed}.json")
        write_model(models[-1], model, card.model_copy(update={"provenance": {"seed": seed}}))
        tunings.append(tmp_path / f"tuning-{seed}.json")
        scores = VoxelScores(f05, f05, f05, f05, f05, tau=0.5, n_samples=1)
        tunings[-1].write_text(json.dumps(Tuning("m", (9, 9, 9), scores, {}, ()).to_json()))
    assert champion(models, tunings, tmp_path / "champion.json") == models[1]
    assert (tmp_path / "champion.json").read_bytes() == models[1].read_bytes()


def test_the_answer_that_users_get_decides_before_the_voxels_at_or_above_tau(tmp_path, pole_finder):
    model, card = pole_finder
    models, tunings = [], []
    for seed, (observer, towers) in enumerate([(0.9, 0.4), (0.5, 0.7), (0.6, 0.7), (0.6, 0.7)]):
        models.append(tmp_path / f"seed-{seed}.json")
        write_model(models[-1], model, card.model_copy(update={"provenance": {"seed": seed}}))
        tunings.append(tmp_path / f"tuning-{seed}.json")
        of_voxels, whole = (
            VoxelScores(*[f05] * 5, tau=0.5, n_samples=1) for f05 in (observer, towers)
        )
        found = Tuning("m", (9, 9, 9), of_voxels, {}, (), whole)
        assert Tuning.from_json(found.to_json()) == found
        tunings[-1].write_text(json.dumps(found.to_json()))
    assert champion(models, tunings, tmp_path / "champion.json") == models[2]
