"""Starts that look at the data."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from scenenet.batches import batch
from scenenet.convolution import convolve_at_voxels
from scenenet.initialisation import discriminant, informed_model
from scenenet.protocol import ModelSettings, TrainingSettings
from scenenet.training import fit, threshold_curve
from scenenet.voxels import VoxelGrid, voxelise


@pytest.fixture(scope="module")
def toys(scene):
    clouds = [scene(((8.5 + i, 9.5),), size=(20, 20), tree=(14, 4 + i), seed=i) for i in range(3)]
    return [voxelise(c, VoxelGrid.metric(c.xyz, 1.0), f"toy-{i}") for i, c in enumerate(clouds)]


def settings(kind: str, init: str = "field", epochs: int = 20) -> ModelSettings:
    training = TrainingSettings(init=init, epochs=epochs, batch_size=2, learning_rate=0.01)
    return ModelSettings(name="m", kind=kind, kernel_size=(5, 5, 5), training=training)


def best(model, samples) -> float:
    return threshold_curve(model, samples, "presence").best()[1].f05


def test_the_discriminant_answers_higher_at_towers_than_a_mean_difference_does(toys):
    size = (5, 5, 5)
    kernel = discriminant(toys, "presence", size)
    assert kernel.shape == size

    def separation(direction: torch.Tensor) -> float:
        answers, towers = [], []
        for sample in toys:
            occupancy, _ = batch([sample], "presence")
            answers.append(convolve_at_voxels(occupancy, direction[None])[0].numpy())
            towers.append(sample.tower)
        answer, tower = np.concatenate(answers), np.concatenate(towers)
        within = np.where(tower, answer[tower].mean(), answer[~tower].mean())
        apart = answer[tower].mean() - answer[~tower].mean()
        return float(apart / (answer - within).std())

    generator = torch.Generator().manual_seed(0)
    others = [torch.rand(size, generator=generator) - 0.5 for _ in range(20)]
    assert separation(kernel) > 2 * max(separation(other) for other in others)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["scenenet", "cnn"])
def test_it_begins_where_towers_are_told_from_the_rest(toys, kind, seed):
    assert best(informed_model(settings(kind), seed, toys), toys) > 0.2


@pytest.mark.parametrize("seed", range(4))
def test_a_cnn_is_alive_after_training(toys, seed):
    model, _ = fit(toys, [], settings("cnn"), seed)
    assert best(model, toys) > 0.2


@pytest.mark.parametrize("kind", ["scenenet", "cnn"])
def test_seeds_begin_apart_and_one_seed_begins_at_one_place(toys, kind):
    one, same, other = (informed_model(settings(kind), s, toys) for s in (1, 1, 2))
    for a, b in zip(one.parameters(), same.parameters(), strict=True):
        assert torch.equal(a, b)
    pairs = zip(one.parameters(), other.parameters(), strict=True)
    assert any(not torch.equal(a, b) for a, b in pairs)
