"""The middle of the draws that score hardly less than the best one."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.dataset.voxels import VoxelGrid, VoxelSample
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.pointcloud.targets import Target
from scenenet.training.presets import preset
from scenenet.training.train import fit

SHAPE = (24, 40, 40)


def span(seed: int) -> VoxelSample:
    """A conductor of 20 m above ground and beside a crown, in voxels of 0.5 m."""
    rng = np.random.default_rng(seed)
    volume = np.zeros(SHAPE, bool)
    volume[1] = rng.random(SHAPE[1:]) < 0.7
    volume[5:15, 3:13, 3:13] = rng.random((10, 10, 10)) < 0.4
    wire = np.zeros(SHAPE, bool)
    wire[18, 28, :] = True
    index = np.flatnonzero(volume | wire)
    labelled = wire.reshape(-1)[index]
    grid = VoxelGrid((0.0, 0.0, 0.0), 0.5, SHAPE)
    return VoxelSample(f"span-{seed}", grid, index, np.ones(len(index), int), labelled)


def settings(starts: int = 24):
    wire = preset("scenenet", "operational", target=Target.parse("wire"))
    search = wire.search.model_copy(update={"starts": starts})
    return wire.model_copy(update={"search": search})


@pytest.fixture(scope="module")
def fitted():
    return fit([span(0)], [span(1)], settings(), seed=0)


def test_the_observer_of_conductors_finds_a_conductor_of_another_scene(fitted):
    _, history = fitted
    assert len(history) == 1
    assert history["validation_f05"].iloc[0] > 0.9


def test_lengths_are_fixed_and_weights_convex(fitted):
    model, _ = fitted
    assert isinstance(model, MetricSceneNet)
    numbers = model.shape_parameters()
    assert {name: numbers[name] for name in model.fixed_numbers()} == pytest.approx(
        model.fixed_numbers(), rel=1e-5
    )
    weights = [numbers[f"first.lambda.{name}"] for name in ("identity", "canopy", "ground")]
    assert sum(weights) == pytest.approx(1, abs=1e-5)
    assert model.evidence["line.l"].source == "fixed"
    assert model.evidence["first.lambda.identity"].source == "score"


def test_the_same_seed_gives_the_same_numbers(fitted):
    again, _ = fit([span(0)], [span(1)], settings(), seed=0)
    assert again.shape_parameters() == fitted[0].shape_parameters()


def test_draws_near_the_best_and_the_error_of_the_crops_find_it_too():
    wire = settings()
    search = wire.search.model_copy(update={"near_best": 0.5, "hardly": None})
    scenes = [span(seed) for seed in (0, 2, 3)]
    model, history = fit(scenes, [span(1)], wire.model_copy(update={"search": search}), seed=0)
    assert history["validation_f05"].iloc[0] > 0.9
    weights = [model.shape_parameters()[f"first.lambda.{n}"] for n in ("identity", "canopy")]
    assert min(weights) > 0 and sum(weights) < 1
