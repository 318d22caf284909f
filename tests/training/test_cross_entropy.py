"""Cross entropy equals torch's where that is finite, and is finite everywhere (thesis 5.3.3)."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from fixtures.dense import convolve_dense
from hypothesis import given
from hypothesis import strategies as st
from torch.nn.functional import binary_cross_entropy

from scenenet.convolution.occupancy import Occupancy
from scenenet.training.cross_entropy import LEAST, cross_entropy

WEIGHTS = (0.7, 5.0)
biases = st.sampled_from([None, 0.0, -0.3, 0.4])


def scene(seed: int, share: float) -> tuple[Occupancy, np.ndarray]:
    """Two random grids, and the positions of some of their voxels, occupied or not, as tower."""
    rng = np.random.default_rng(seed)
    indices = [np.flatnonzero(rng.random(120) < share) for _ in range(2)]
    return Occupancy.of_grids(indices, None, (4, 5, 6)), np.flatnonzero(rng.random(240) < 0.1)


def numbers(seed: int, bias, dtype=torch.float64, scale=0.3):
    kernel = torch.from_numpy(scale * np.random.default_rng(seed).normal(size=(3, 2, 3)))
    kernel = kernel.to(dtype).requires_grad_()
    return kernel, None if bias is None else torch.tensor(bias, dtype=dtype, requires_grad=True)


def plain(occupancy, kernel, bias, tower) -> torch.Tensor:
    """Cross entropy of torch, with the same lower bound on the probability of tower voxels."""
    answer = convolve_dense(occupancy, kernel) + (0 if bias is None else bias)
    probability = torch.relu(torch.tanh(answer)).reshape(-1)
    truth = torch.zeros_like(probability)
    truth[torch.from_numpy(tower)] = 1
    probability = torch.where(truth > 0, probability.clamp(min=LEAST), probability)
    weight = WEIGHTS[0] + (WEIGHTS[1] - WEIGHTS[0]) * truth
    return binary_cross_entropy(probability, truth, weight, reduction="sum")


@given(st.integers(0, 99), biases, st.sampled_from([0.0, 0.05, 0.5]))
def test_value_and_gradient_are_those_of_torch(seed, bias, share):
    occupancy, tower = scene(seed, share)
    kernel, offset = numbers(seed, bias)
    inputs = [kernel] if offset is None else [kernel, offset]
    ours = cross_entropy(occupancy, kernel, offset, tower, WEIGHTS)
    expected = plain(occupancy, kernel, offset, tower)
    torch.testing.assert_close(ours, expected, rtol=1e-9, atol=1e-9)
    pairs = zip(
        torch.autograd.grad(ours, inputs), torch.autograd.grad(expected, inputs), strict=True
    )
    for a, b in pairs:
        torch.testing.assert_close(a, b, rtol=1e-6, atol=1e-6)


def test_by_hand():
    occupancy = Occupancy.of_grids([np.array([1])], None, (1, 1, 4))
    kernel = torch.tensor([0.0, 0.5, 0.0], dtype=torch.float64).reshape(1, 1, 3)
    p = math.tanh(0.5)
    at_tower = cross_entropy(occupancy, kernel, None, np.array([1]), (2.0, 8.0))
    beside_it = cross_entropy(occupancy, kernel, None, np.array([3]), (2.0, 8.0))
    assert at_tower.item() == pytest.approx(-8 * math.log(p))
    assert beside_it.item() == pytest.approx(-2 * math.log(1 - p) - 8 * math.log(LEAST))


def test_an_observer_without_response_has_the_error_of_its_towers_and_no_slope():
    occupancy, tower = scene(3, 0.3)
    kernel = torch.full((3, 2, 3), -1.0, requires_grad=True)
    loss = cross_entropy(occupancy, kernel, None, tower, WEIGHTS)
    assert loss.item() == pytest.approx(-WEIGHTS[1] * len(tower) * math.log(LEAST), rel=1e-6)
    (slope,) = torch.autograd.grad(loss, [kernel])
    assert not slope.any()


def test_a_wrong_probability_of_1_has_a_finite_error_and_a_slope():
    occupancy = Occupancy.of_grids([np.array([1])], None, (1, 1, 3))
    kernel = torch.full((1, 1, 1), 40.0, requires_grad=True)
    assert torch.tanh(kernel).item() == 1.0
    loss = cross_entropy(occupancy, kernel, None, np.empty(0, np.int64), (1.0, 1.0))
    assert loss.item() == pytest.approx(80 - math.log(2))
    (slope,) = torch.autograd.grad(loss, [kernel])
    assert slope.item() == pytest.approx(2.0)  # 1 + p


def test_nan_in_the_kernel_gives_a_nan_error():
    occupancy, tower = scene(3, 0.3)
    kernel = torch.full((3, 3, 3), float("nan"))
    assert torch.isnan(cross_entropy(occupancy, kernel, None, tower, WEIGHTS))
    assert torch.isnan(cross_entropy(occupancy, kernel, None, tower[:0], WEIGHTS))
