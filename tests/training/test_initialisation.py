"""Initial models that depend on the data."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from scenenet.convolution.convolve import convolve_at_voxels
from scenenet.dataset.batches import batch
from scenenet.geneo import kernel_named
from scenenet.models.factory import new_model
from scenenet.models.predictions import threshold_curve
from scenenet.models.published_weights import WEIGHTS
from scenenet.models.settings import ModelSettings, TrainingSettings
from scenenet.training.initialisation import discriminant, informed_model, starting_model
from scenenet.training.train import fit


@pytest.fixture(scope="module")
def crops(pole_crops):
    return pole_crops()[:3]


def settings(kind: str, init: str = "informed", epochs: int = 20) -> ModelSettings:
    training = TrainingSettings(init=init, epochs=epochs, batch_size=2, learning_rate=0.01)
    return ModelSettings(name="m", kind=kind, kernel_size=(5, 5, 5), training=training)


def best(model, samples) -> float:
    return threshold_curve(model, samples, "presence").best()[1].f05


def test_the_discriminant_separates_towers_better_than_a_mean_difference(crops):
    size = (5, 5, 5)
    kernel = discriminant(crops, "presence", size)
    assert kernel.shape == size

    def separation(direction: torch.Tensor) -> float:
        answers, towers = [], []
        for sample in crops:
            occupancy, _ = batch([sample], "presence")
            answers.append(convolve_at_voxels(occupancy, direction[None])[0].numpy())
            towers.append(sample.labelled)
        answer, tower = np.concatenate(answers), np.concatenate(towers)
        within = np.where(tower, answer[tower].mean(), answer[~tower].mean())
        apart = answer[tower].mean() - answer[~tower].mean()
        return float(apart / (answer - within).std())

    generator = torch.Generator().manual_seed(0)
    others = [torch.rand(size, generator=generator) - 0.5 for _ in range(20)]
    assert separation(kernel) > 2 * max(separation(other) for other in others)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["scenenet", "cnn"])
def test_the_initial_model_separates_towers_from_the_rest(crops, kind, seed):
    assert best(informed_model(settings(kind), seed, crops), crops) > 0.2


@pytest.mark.parametrize("seed", range(4))
def test_a_cnn_is_alive_after_training(crops, seed):
    model, _ = fit(crops, [], settings("cnn"), seed)
    assert best(model, crops) > 0.2


@pytest.mark.parametrize("kind", ["scenenet", "cnn"])
def test_initial_models_differ_between_seeds_and_are_reproducible(crops, kind):
    one, same, other = (informed_model(settings(kind), s, crops) for s in (1, 1, 2))
    for a, b in zip(one.parameters(), same.parameters(), strict=True):
        assert torch.equal(a, b)
    pairs = zip(one.parameters(), other.parameters(), strict=True)
    assert any(not torch.equal(a, b) for a, b in pairs)


def test_the_initial_model_of_the_thesis_is_drawn_from_the_ranges(crops):
    initial = starting_model(settings("scenenet", "thesis"), 3, crops)
    drawn = new_model(settings("scenenet", "thesis"), 3)
    assert initial.shape_parameters() == drawn.shape_parameters()
    for name in initial.names:
        for parameter in kernel_named(name).parameters:
            value = initial.shape_parameters()[f"{name}.{parameter.name}"]
            assert parameter.low <= value <= parameter.high


def test_unranged_parameters_are_normal_and_mostly_outside_the_ranges(crops):
    vectors = [
        starting_model(settings("scenenet", "unranged"), seed, crops).numbers()
        for seed in range(60)
    ]
    drawn = np.concatenate(vectors)
    assert abs(drawn.mean()) < 0.15
    assert abs(drawn.std() - 1) < 0.1
    assert 0.4 < (drawn < 0).mean() < 0.6
    again = starting_model(settings("scenenet", "unranged"), 7, crops).numbers()
    np.testing.assert_array_equal(vectors[7], again)


def test_handcrafted_values_are_in_their_ranges_and_equal_for_every_seed(crops):
    chosen = settings("scenenet", "handcrafted")
    chosen = chosen.model_copy(update={"geneos": ("cylinder", "arrow", "negative_sphere", "arrow")})
    one, other = (starting_model(chosen, seed, crops) for seed in (0, 1))
    numbers = one.shape_parameters()
    assert numbers == other.shape_parameters()
    for name, geneo in zip(one.names, one.geneos, strict=True):
        assert numbers[f"lambda.{name}"] == pytest.approx(0.25)
        for parameter in kernel_named(geneo).parameters:
            assert parameter.low <= numbers[f"{name}.{parameter.name}"] <= parameter.high
    assert numbers["cylinder.r"] == pytest.approx(2.0)  # half of 4.15 m, in voxels of a metre


@pytest.mark.parametrize("init", ["unranged", "handcrafted", "published"])
def test_unranged_initialisation_of_a_cnn_is_refused(init):
    with pytest.raises(ValueError, match=r"training.init .* a CNN has no parameter ranges"):
        settings("cnn", init)


def test_published_weights_are_the_same_for_every_seed(crops):
    published = settings("scenenet", "published")
    models = [starting_model(published, seed, crops) for seed in (0, 1)]
    for model in models:
        assert model.shape_parameters() == pytest.approx(WEIGHTS, abs=1e-5)


def test_published_weights_need_the_kernels_of_the_thesis():
    with pytest.raises(ValueError, match="remove geneos"):
        ModelSettings(
            name="m", kind="scenenet", geneos=["cylinder"], training={"init": "published"}
        )
