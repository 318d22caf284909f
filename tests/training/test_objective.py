"""The search without a gradient."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from scenenet.dataset.batches import batch
from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.geneo import kernel_named
from scenenet.metrics.threshold_choice import STEPS, best_step
from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve
from scenenet.metrics.voxel_scores import confusion
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.predictions import (
    Answers,
    curve_of,
    prepare_crops,
    probabilities,
    volumes,
)
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import MetricSettings
from scenenet.training.evolution import NEAR_BEST, State, advance, begin, settled
from scenenet.training.objective import draws, near_the_best


def model(seed: int = 0) -> SceneNet:
    lengths = MetricSettings(numbers="searched")
    return MetricSceneNet(metric=lengths, generator=torch.Generator().manual_seed(seed))


def bowl(x: np.ndarray) -> float:
    """Highest, 0, at 1, 2, 3, ...; much steeper along some axes than along others."""
    away = x - np.arange(1, len(x) + 1)
    return -float((away**2 * 10.0 ** np.arange(len(x))).sum())


def test_the_search_climbs_a_narrow_ridge():
    state = begin(np.zeros((1, 4)), bowl, 0.5, 12, [0])
    for _ in range(150):
        state = advance(state, bowl)
    assert state.generation == 150
    np.testing.assert_allclose(settled(state, bowl).best, [1, 2, 3, 4], atol=1e-3)


def test_the_search_starts_at_the_best_draw_and_keeps_the_best():
    starts = np.array([[9.0, 9.0], [1.0, 2.5], [-3.0, 0.0]])
    state = begin(starts, bowl, 0.1, 8, [0])
    assert state.best.tolist() == [1.0, 2.5]
    scores = [state.best_score]
    for _ in range(20):
        state = advance(state, bowl)
        scores.append(state.best_score)
        assert bowl(state.best) == state.best_score
    assert scores == sorted(scores)


def test_the_mean_is_returned_unless_the_best_draw_is_clearly_better():
    def score(x):
        return float(x[0])

    state = begin(np.array([[0.5, 0.0]]), score, 0.1, 6, [0])
    middle = settled(advance(state, score), score)
    assert middle.best_score >= 0.5 - NEAR_BEST


def test_false_voxels_that_count_more_make_the_threshold_higher():
    rng = np.random.default_rng(0)
    probability = np.tanh(np.concatenate([rng.normal(1.2, 0.4, 300), rng.normal(0.3, 0.4, 3000)]))
    truth = np.arange(3300) < 300
    curve = ThresholdCurve.of(np.maximum(probability, 0), truth)
    (plain, f05), (careful, _) = best_step(curve, 1.0), best_step(curve, 4.0)
    assert careful > plain
    counts = confusion(np.maximum(probability, 0), truth, THRESHOLDS[plain])
    assert f05 == pytest.approx(counts.f05)


def test_the_thresholds_that_are_tried_are_five_percent_apart():
    observed = np.arctanh(THRESHOLDS[STEPS])
    assert observed[0] == pytest.approx(0.01)
    assert (np.diff(observed)[observed[1:] > 1] / observed[:-1][observed[1:] > 1] < 0.07).all()


def test_draws_cover_the_ranges_and_all_mixtures():
    net = model()
    numbers = draws(net, 500, np.random.default_rng(0))
    assert numbers.shape == (500, 11)
    seen = []
    for row in numbers:
        net.set_numbers(row)
        seen.append(net.shape_parameters())
    low, high = kernel_named("cylinder").parameters[0].metric_range
    radius = [s["cylinder.r"] for s in seen]
    assert low < min(radius) < 1.2 * low
    assert 0.9 * high < max(radius) < high
    for name in net.names:
        weight = [s[f"lambda.{name}"] for s in seen]
        assert min(weight) < 0.05 and max(weight) > 0.8


@pytest.mark.parametrize("voxel_size", [1.0, 0.5])
def test_prepared_crops_give_the_probabilities_of_the_model(scene, voxel_size):
    cloud = scene(size=(16, 16), poles=((8.5, 8.5),), tree=(3, 3))
    sample = voxelise(cloud, VoxelGrid.metric(cloud.xyz, voxel_size))
    net = model(3)
    (ready,) = prepare_crops(net, [sample], "presence")
    assert ready.voxel_size == 1.0
    occupied = Answers(net)(ready)
    probability, truth = probabilities(net, sample, "presence")
    np.testing.assert_array_equal(probability[sample.index], occupied)
    assert probability.sum() == pytest.approx(occupied.sum(), rel=1e-5)
    with torch.no_grad():
        volume = net.at(1.0)(ready.observed).numpy().reshape(-1)
    np.testing.assert_allclose(volume[ready.observed.index][ready.row], occupied, atol=1e-6)
    volume = volumes(net, batch([sample], "presence")[0], voxel_size)
    np.testing.assert_allclose(volume.reshape(-1), probability, atol=1e-6)
    curve = curve_of(net, [ready])
    counts = curve.confusion(100)
    assert counts == confusion(probability, truth, float(np.float32(THRESHOLDS[100])))


def test_a_search_goes_on_from_its_seed_and_scores_as_if_it_had_not_stopped():
    state = begin(np.zeros((1, 4)), bowl, 0.5, 12, [3, 1])
    for _ in range(10):
        state = advance(state, bowl)
    kept = State(state.first, state.step, state.seed, state.scores, state.best, state.best_score)
    for _ in range(10):
        state, kept = advance(state, bowl), advance(kept, bowl)
    np.testing.assert_array_equal(kept.scores, state.scores)
    np.testing.assert_array_equal(settled(kept, bowl).best, settled(state, bowl).best)


def test_further_draws_lie_where_the_best_ones_are():
    rng = np.random.default_rng(0)
    drawn = rng.uniform(-5, 5, (60, 2))
    scores = -np.abs(drawn - [2, -1]).sum(axis=1)
    near = near_the_best(drawn, scores, 200, rng)
    assert near.shape == (200, 2)
    assert np.abs(near.mean(axis=0) - [2, -1]).max() < 0.7
    assert near.std(axis=0).max() < 0.5 * drawn.std(axis=0).min()
    assert near_the_best(drawn[:1], scores[:1], 3, rng) == pytest.approx(np.tile(drawn[0], (3, 1)))
