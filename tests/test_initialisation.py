"""Starts that look at the data."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from scenenet.batches import batch
from scenenet.convolution import convolve
from scenenet.initialisation import informed_model, mean_surroundings
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


def test_surroundings_are_the_mean_of_what_is_around(toys):
    size = (5, 3, 4)
    around_tower, around_other = mean_surroundings(toys[:1], "presence", size)
    occupancy, towers = batch(toys[:1], "presence")
    kernel = torch.rand(size, generator=torch.Generator().manual_seed(0))
    answer = convolve(occupancy, kernel).reshape(-1)
    truth = np.zeros(occupancy.n_voxels, bool)
    truth[towers] = True
    occupied = occupancy.flat()
    expected = answer[occupied[truth[occupied]]].mean()
    torch.testing.assert_close((kernel * around_tower).sum(), expected)
    expected = answer[occupied[~truth[occupied]]].mean()
    torch.testing.assert_close((kernel * around_other).sum(), expected)


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
