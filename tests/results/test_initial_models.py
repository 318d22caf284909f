"""The initial model is drawn again, or read from the history."""

from __future__ import annotations

import pandas as pd
import pytest
import torch

from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.models.factory import new_model
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.settings import MetricSettings, ModelSettings, TrainingSettings
from scenenet.results.initial_models import DRAWN, FIRST_STEP, initial_model
from scenenet.results.seed_result import SeedResult
from scenenet.training.train import fit


def result(settings: ModelSettings, history: pd.DataFrame | None = None) -> SeedResult:
    recorded = {"settings": settings.model_dump(mode="json")}
    return SeedResult(settings.name, settings.kind, 3, {}, history=history, provenance=recorded)


def test_the_initial_model_of_the_thesis_protocol_follows_from_the_seed(scene):
    """A training with steps of length 0 ends with the initial model."""
    cloud = scene(((8.5, 9.5),), size=(20, 20), tree=None)
    crops = [voxelise(cloud, VoxelGrid.metric(cloud.xyz, 1.0), "toy")]
    still = TrainingSettings(epochs=1, learning_rate=1e-30)
    for kind in ("scenenet", "cnn"):
        settings = ModelSettings(name="m", kind=kind, kernel_size=(5, 5, 5), training=still)
        trained, history = fit(crops, [], settings, seed=3)
        start = initial_model(result(settings, history), trained)
        assert start is not None
        assert start.origin == DRAWN
        began, ended = start.model.observer()[0], trained.observer()[0]
        assert torch.allclose(began, ended, atol=1e-6)


def test_initial_kernels_are_shown_at_the_tuned_size():
    settings = ModelSettings(name="m", kind="scenenet", kernel_size=(9, 9, 9))
    tuned = new_model(settings, 3).with_kernel_size((9, 5, 5))
    start = initial_model(result(settings), tuned)
    assert start is not None
    assert start.model.kernel_size == (9, 5, 5)


def test_the_initial_model_of_a_search_is_the_first_row_of_its_history():
    searched = MetricSettings(numbers="searched")
    settings = ModelSettings(name="m", kind="scenenet", protocol="operational", metric=searched)
    trained = new_model(settings, 3).at(0.5)
    assert isinstance(trained, GeneoModel)
    first = trained.shape_parameters() | {"cylinder.r": 0.7}
    rows = [{"epoch": 1, "loss": 0.9, "search": 2, **first}, {"epoch": 2, "loss": 0.8, **first}]
    rows[1]["cylinder.r"] = 0.2
    start = initial_model(result(settings, pd.DataFrame(rows)), trained)
    assert start is not None
    assert start.origin == FIRST_STEP
    assert isinstance(start.model, GeneoModel)
    assert start.model.shape_parameters()["cylinder.r"] == pytest.approx(0.7)
    assert start.model.kernel_size == trained.kernel_size


def test_an_initial_model_that_depends_on_data_is_not_drawn_again():
    informed = TrainingSettings(init="informed")
    settings = ModelSettings(name="m", kind="scenenet", training=informed)
    assert initial_model(result(settings), new_model(settings, 3)) is None
    cnn = ModelSettings(name="m", kind="cnn", training=informed)
    assert initial_model(result(cnn), new_model(cnn, 3)) is None


def test_settings_that_this_version_refuses_are_reported(capsys):
    """Version 0.1 recorded settings without effect as well, and called the start ``field``."""
    model = MetricSceneNet(metric=MetricSettings())
    for settings, fault in (
        ({"name": "m", "kind": "cnn", "geneos": ["arrow"]}, "settings: "),
        ({"name": "m", "kind": "scenenet", "training": {"init": "field"}}, "training: "),
    ):
        record = SeedResult("m", "scenenet", 3, {}, provenance={"settings": settings})
        assert initial_model(record, model) is None
        message = capsys.readouterr().err
        assert message.startswith("m seed 3: the recorded settings are not those of this version")
        assert fault in message


def test_without_a_record_and_a_history_the_initial_model_is_unknown(capsys):
    model = MetricSceneNet(metric=MetricSettings())
    assert initial_model(SeedResult("m", "scenenet", 3, {}), model) is None
    assert capsys.readouterr().err == ""
