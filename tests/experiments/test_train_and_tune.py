"""Each model is trained and tuned as elsewhere, and never on the crops of its scores."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.baselines import boosted_trees
from scenenet.core.errors import InputError
from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.experiments.train_and_tune import train_and_tune
from scenenet.metrics.threshold_curve import ThresholdCurve
from scenenet.metrics.voxel_scores import confusion
from scenenet.models.model_file import ModelCard
from scenenet.models.settings import ModelSettings, SearchSettings, TrainingSettings, TuningSettings
from scenenet.pointcloud import PointCloud
from scenenet.pointcloud.class_schemes import EDP
from scenenet.synthetic import SyntheticSettings, corridor_cloud
from scenenet.training.train import fit
from scenenet.training.tuning import choose

QUICK = TrainingSettings(epochs=2, learning_rate=0.01, init="informed")
FIELD = ModelSettings(
    name="m",
    kind="scenenet",
    protocol="operational",
    search=SearchSettings(searches=1, trial=1, starts=8, population=6, generations=3),
)
MODELS = [
    FIELD,
    ModelSettings(name="m", kind="scenenet", kernel_size=(5, 5, 5), training=QUICK),
    ModelSettings(name="m", kind="cnn", kernel_size=(5, 5, 5), training=QUICK),
]


@pytest.fixture(scope="module")
def crops():
    cloud, _, towers = corridor_cloud(
        SyntheticSettings(towers=5, seed=3, density=12, tower_density=24)
    )
    samples = []
    for tower in towers:
        inside = np.hypot(*(cloud.xyz[:, :2] - (tower.x, tower.y)).T) <= tower.height
        crop = PointCloud(cloud.xyz[inside], cloud.classification[inside], EDP)
        samples.append(voxelise(crop, VoxelGrid.cube(crop.xyz, 32), str(tower.id)))
    return samples


@pytest.mark.parametrize("settings", MODELS, ids=["operational", "thesis", "cnn"])
def test_with_validation_crops_a_model_is_tuned_as_in_the_workflow(crops, settings):
    tuned_model = train_and_tune(settings, crops[:3], crops[3:4], 1)
    model, _ = fit(crops[:3], [], settings, 1)
    card = ModelCard(
        name="m", codes="edp", measurement="presence", fit="cube", resolution=32, voxel_size=1.0
    )
    _, card, tuning = choose(model, card, crops[3:4], TuningSettings(), crops[:3])
    assert tuned_model.tau == card.threshold()
    assert tuned_model.f05 == tuning.validation.f05
    assert tuned_model.parameters == model.n_parameters()
    probability, truth = tuned_model.predict(crops[4])
    assert tuned_model.score(crops[4:]) == confusion(probability, truth, tuned_model.tau)
    curve = tuned_model.curve(crops[4:])
    np.testing.assert_array_equal(curve.true, ThresholdCurve.of(probability, truth).true)


def test_without_validation_tau_is_of_the_training_crops(crops):
    thesis = train_and_tune(MODELS[1], crops[:3], [], 1)
    assert thesis.tau == thesis.curve(crops[:3]).best()[0]


def test_boosted_trees_are_never_tuned_on_their_training_crops(crops, few_trees):
    tuned, curve = boosted_trees.fit_and_tune(crops[:3], few_trees, 2)
    tuned_model = train_and_tune(None, crops[:3], [], 2)
    assert (tuned_model.tau, tuned_model.f05) == (tuned.threshold(), curve.best()[1].f05)
    with_validation = train_and_tune(None, crops[:3], crops[3:4], 2)
    assert with_validation.tau == with_validation.curve(crops[3:4]).best()[0]
    assert with_validation.f05 == with_validation.score(crops[3:4]).f05
    with pytest.raises(InputError, match="two crops or more"):
        train_and_tune(None, crops[:1], [], 0)


def test_a_training_that_diverges_detects_nothing(crops):
    wild = TrainingSettings(epochs=3, learning_rate=1e30, optimiser="sgd")
    settings = ModelSettings(name="m", kind="cnn", kernel_size=(3, 3, 3), training=wild)
    tuned_model = train_and_tune(settings, crops[:3], [], 0)
    assert tuned_model.f05 == 0
    counts = tuned_model.score(crops)
    assert (counts.tp, counts.fp) == (0, 0)
    assert counts.fn == sum(int(sample.labelled.sum()) for sample in crops)
    assert tuned_model.parameters == 3 * 27 + 3
