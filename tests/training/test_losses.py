"""The GENEO loss, with numbers that can be calculated by hand (thesis 4.5)."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from scenenet.convolution.occupancy import Occupancy
from scenenet.models.cnn import CNN
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import LossSettings
from scenenet.training.losses import VoxelWeights, fidelity, negativity


def test_weights_of_the_thesis_setting_by_hand():
    # p(1) = 0.1, p(0) = 0.9, alpha 5: f''(1) = 1 - 0.5 = 0.5, f''(0) = max(1 - 4.5, 0.1) = 0.1
    # mean f'' = 0.1 * 0.5 + 0.9 * 0.1 = 0.14
    weights = VoxelWeights.of_counts(10, 100, alpha=5.0, epsilon=0.1)
    assert weights.tower == pytest.approx(0.5 / 0.14)
    assert weights.empty == pytest.approx(0.1 / 0.14)


def test_the_rarer_a_tower_voxel_the_more_it_weighs_up_to_one_over_epsilon():
    ratios = []
    for n_tower in (1000, 100, 10):
        weights = VoxelWeights.of_counts(n_tower, 10_000, alpha=5.0, epsilon=0.1)
        ratios.append(weights.tower / weights.empty)
    assert ratios == pytest.approx([5.0, 9.5, 9.95])


@given(
    st.integers(0, 1000), st.integers(1000, 10**6), st.floats(0, 20), st.floats(0.001, 1)
)  # fmt: skip
def test_the_mean_weight_is_one_and_none_is_zero(n_tower, n_voxels, alpha, epsilon):
    weights = VoxelWeights.of_counts(n_tower, n_voxels, alpha, epsilon)
    total = n_tower * weights.tower + (n_voxels - n_tower) * weights.empty
    assert total / n_voxels == pytest.approx(1.0)
    assert weights.tower > 0
    assert weights.empty > 0


@given(st.integers(0, 1000), st.integers(1000, 10**6), st.floats(0.001, 1))
def test_weights_are_uniform_for_alpha_0(n_tower, n_voxels, epsilon):
    weights = VoxelWeights.of_counts(n_tower, n_voxels, 0.0, epsilon)
    assert (weights.tower, weights.empty) == pytest.approx((1.0, 1.0))


def scene(seed: int, share: float = 0.2) -> tuple[Occupancy, np.ndarray]:
    """Two random grids and the positions of some of their voxels, as tower."""
    rng = np.random.default_rng(seed)
    indices = [np.flatnonzero(rng.random(60) < share) for _ in range(2)]
    occupancy = Occupancy.of_grids(indices, None, (3, 4, 5))
    flat = occupancy.flat()
    return occupancy, flat[rng.random(len(flat)) < 0.3]


@given(st.integers(0, 99), st.sampled_from([0.0, 0.2, 1.0]))
def test_fidelity_is_the_mean_of_the_weighted_squared_error(seed, share):
    occupancy, tower = scene(seed, share)
    weights = VoxelWeights(empty=0.7, tower=9.0)
    model = SceneNet(kernel_size=(3, 3, 3), generator=torch.Generator().manual_seed(seed))
    prediction = model(occupancy).reshape(-1)
    truth = torch.zeros(occupancy.n_voxels)
    truth[torch.from_numpy(tower)] = 1
    expected = (torch.where(truth > 0, 9.0, 0.7) * (prediction - truth) ** 2).mean()
    torch.testing.assert_close(fidelity(model, occupancy, tower, weights), expected)


def test_the_error_of_a_model_without_detections_is_the_weight_of_the_towers():
    occupancy, tower = scene(1)
    model = CNN(1, (3, 3, 3))
    with torch.no_grad():
        model.weight.zero_()
        model.bias.fill_(-1.0)
    loss = fidelity(model, occupancy, tower, VoxelWeights(empty=2.0, tower=8.0))
    assert loss.item() == pytest.approx(8.0 * len(tower) / 120)


POSITIVE = {
    "cylinder.r": 1.0, "cylinder.sigma": 1.0,
    "arrow.r": 1.0, "arrow.sigma": 1.0, "arrow.r_c": 1.0, "arrow.beta": 0.5,
    "negative_sphere.r": 1.0, "negative_sphere.sigma": 1.0, "negative_sphere.omega": 0.1,
    "lambda.cylinder": 0.3, "lambda.arrow": 0.3, "lambda.negative_sphere": 0.4,
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "penalty"),
    [
        ({}, 0.0),
        ({"cylinder.sigma": -0.5}, 2 * 0.5),
        ({"arrow.beta": -0.25, "negative_sphere.r": -1.0}, 2 * 1.25),
        # The derived weight is penalised like the others.
        ({"lambda.cylinder": 0.8, "lambda.negative_sphere": -0.1}, 3 * 0.1),
        ({"lambda.cylinder": -0.5, "lambda.negative_sphere": 1.2, "arrow.r": -1.0}, 3 * 0.5 + 2),
    ],
)
def test_a_negative_parameter_costs_rho_times_its_absolute_value(changes, penalty):
    model = SceneNet()
    model.set_shape_parameters(POSITIVE | changes)
    settings = LossSettings(rho_shape=2.0, rho_mixing=3.0)
    assert negativity(model, settings).item() == pytest.approx(penalty, abs=1e-6)


def test_the_penalty_only_raises_negative_parameters():
    model = SceneNet()
    model.set_shape_parameters(POSITIVE | {"cylinder.sigma": -0.5})
    negativity(model, LossSettings(rho_shape=5.0)).backward()
    assert model.shapes["cylinder"]["sigma"].grad.item() == -5.0
    assert model.shapes["cylinder"]["r"].grad.item() == 0.0


def test_a_quadratic_penalty_is_weak_just_below_zero_where_a_linear_one_is_not():
    slopes = {}
    for penalty in ("linear", "quadratic"):
        model = SceneNet()
        model.set_shape_parameters(POSITIVE | {"cylinder.sigma": -0.01, "arrow.r": -2.0})
        settings = LossSettings(penalty=penalty, rho_shape=5.0)
        loss = negativity(model, settings)
        loss.backward()
        sigma, r = model.shapes["cylinder"]["sigma"], model.shapes["arrow"]["r"]
        # The absolute value of a negative parameter, or its square.
        lacks = torch.relu(-torch.stack([sigma, r]).detach())
        expected = lacks.sum() if penalty == "linear" else (lacks**2).sum()
        torch.testing.assert_close(loss.detach(), 5.0 * expected)
        slopes[penalty] = (sigma.grad.item(), r.grad.item())
    assert slopes["linear"] == pytest.approx((-5.0, -5.0))
    assert slopes["quadratic"] == pytest.approx((-0.1, -20.0))


@given(st.integers(0, 99))
def test_fidelity_is_the_mean_of_the_weighted_cross_entropy(seed):
    occupancy, tower = scene(seed)
    weights = VoxelWeights(empty=0.7, tower=9.0)
    model = SceneNet(kernel_size=(3, 3, 3), generator=torch.Generator().manual_seed(seed))
    with torch.no_grad():
        prediction = model(occupancy).reshape(-1).double()
    truth = torch.zeros(occupancy.n_voxels, dtype=torch.float64)
    truth[torch.from_numpy(tower)] = 1
    likelihood = torch.where(truth > 0, prediction.clamp(min=1e-6), 1 - prediction)
    expected = -(torch.where(truth > 0, 9.0, 0.7) * likelihood.log()).mean()
    got = fidelity(model, occupancy, tower, weights, "cross_entropy")
    torch.testing.assert_close(got.double(), expected, rtol=1e-4, atol=1e-5)


def test_a_cnn_has_no_penalty():
    assert negativity(CNN(), LossSettings()).item() == 0.0


def test_the_defaults_are_those_of_the_thesis():
    settings = LossSettings()
    assert (settings.alpha, settings.epsilon) == (5.0, 0.1)
    assert (settings.rho_shape, settings.rho_mixing) == (5.0, 5.0)
    assert (settings.fidelity, settings.penalty) == ("squared", "linear")
