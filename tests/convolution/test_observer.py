"""tanh, ReLU, error and counts plane by plane are those of the whole volume."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from fixtures.dense import convolve_dense, squared_error_dense
from hypothesis import given
from hypothesis import strategies as st

from scenenet.convolution.observer import count_reached, observe, squared_error
from scenenet.convolution.occupancy import Occupancy
from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve

sizes = st.tuples(*[st.integers(1, 5)] * 3)
shapes = st.tuples(st.integers(1, 20), st.integers(1, 7), st.integers(1, 18))
biases = st.sampled_from([None, 0.0, -0.3, 0.4])
WEIGHTS = (0.7, 5.0)


def scene(shape, seed: int, share: float, valued: bool) -> tuple[Occupancy, np.ndarray]:
    """Two random grids, and the positions of some of their voxels, occupied or not, as tower."""
    rng = np.random.default_rng(seed)
    volume = int(np.prod(shape))
    indices = [np.flatnonzero(rng.random(volume) < share) for _ in range(2)]
    values = [rng.random(len(i)) for i in indices] if valued else None
    tower = np.flatnonzero(rng.random(2 * volume) < 0.1)
    return Occupancy.of_grids(indices, values, shape), tower


def numbers(size, bias, seed: int, dtype=torch.float64, scale=0.5):
    kernel = scale * np.random.default_rng(seed).normal(size=size)
    kernel = torch.from_numpy(kernel).to(dtype).requires_grad_()
    return kernel, None if bias is None else torch.tensor(bias, dtype=dtype, requires_grad=True)


def dense(occupancy, kernel, bias) -> torch.Tensor:
    return torch.relu(torch.tanh(convolve_dense(occupancy, kernel) + (0 if bias is None else bias)))


def gradients(loss, kernel, bias) -> list[torch.Tensor]:
    return list(torch.autograd.grad(loss, [kernel] if bias is None else [kernel, bias]))


@given(shapes, sizes, biases, st.sampled_from([0.0, 0.05, 0.5]), st.booleans(), st.integers(0, 99))
def test_probabilities_and_their_gradient(shape, size, bias, share, valued, seed):
    occupancy, _ = scene(shape, seed, share, valued)
    kernel, offset = numbers(size, bias, seed)
    weight = torch.from_numpy(np.random.default_rng(seed).normal(size=(2, *shape)))
    ours, expected = observe(occupancy, kernel, offset), dense(occupancy, kernel, offset)
    torch.testing.assert_close(ours, expected, rtol=0, atol=1e-12)
    for a, b in zip(
        gradients((ours * weight).sum(), kernel, offset),
        gradients((expected * weight).sum(), kernel, offset),
        strict=True,
    ):
        torch.testing.assert_close(a, b, rtol=0, atol=1e-10)


@given(shapes, sizes, biases, st.sampled_from([0.0, 0.05, 0.5]), st.booleans(), st.integers(0, 99))
def test_the_error_and_its_gradient(shape, size, bias, share, valued, seed):
    occupancy, tower = scene(shape, seed, share, valued)
    kernel, offset = numbers(size, bias, seed)
    ours = squared_error(occupancy, kernel, offset, tower, WEIGHTS)
    expected = squared_error_dense(dense(occupancy, kernel, offset), tower, WEIGHTS)
    torch.testing.assert_close(ours, expected, rtol=1e-10, atol=1e-10)
    for a, b in zip(
        gradients(ours, kernel, offset), gradients(expected, kernel, offset), strict=True
    ):
        torch.testing.assert_close(a, b, rtol=1e-9, atol=1e-9)


def test_the_error_by_hand():
    occupancy = Occupancy.of_grids([np.array([1])], None, (1, 1, 4))
    kernel = torch.tensor([0.0, 0.5, 0.0], dtype=torch.float64).reshape(1, 1, 3)
    p = np.tanh(0.5)
    at_tower = squared_error(occupancy, kernel, None, np.array([1]), (2.0, 8.0))
    beside_it = squared_error(occupancy, kernel, None, np.array([3]), (2.0, 8.0))
    assert at_tower.item() == pytest.approx(8 * (1 - p) ** 2)
    assert beside_it.item() == pytest.approx(2 * p**2 + 8)


@pytest.mark.parametrize("bias", [None, 0.2])
def test_gradcheck_of_the_error(bias):
    occupancy, tower = scene((4, 5, 6), 3, 0.3, valued=False)
    kernel, offset = numbers((3, 2, 3), bias, 1)
    inputs = [kernel] if offset is None else [kernel, offset]
    assert torch.autograd.gradcheck(
        lambda k, b=None: squared_error(occupancy, k, b, tower, WEIGHTS), inputs
    )


def test_nan_in_the_kernel_gives_a_nan_error():
    occupancy, tower = scene((4, 5, 6), 3, 0.3, valued=False)
    kernel = torch.full((3, 3, 3), float("nan"))
    assert torch.isnan(squared_error(occupancy, kernel, None, tower, WEIGHTS))


@given(
    shapes, sizes, biases, st.sampled_from([0.0, 0.05, 0.5]), st.sampled_from([0.01, 0.5, 5.0]),
    st.integers(0, 99),
)  # fmt: skip
def test_counts_at_every_threshold(shape, size, bias, share, scale, seed):
    occupancy, tower = scene(shape, seed, share, valued=False)
    kernel, offset = numbers(size, bias, seed, torch.float32, scale)
    with torch.no_grad():
        probability = observe(occupancy, kernel, offset).numpy().reshape(-1)
    truth = np.zeros(occupancy.n_voxels, bool)
    truth[tower] = True
    expected = ThresholdCurve.of(probability, truth)
    counted = ThresholdCurve(*count_reached(occupancy, kernel, offset, tower, THRESHOLDS))
    np.testing.assert_array_equal(counted.true, expected.true)
    np.testing.assert_array_equal(counted.false, expected.false)


def test_the_error_of_a_single_precision_probability_is_rounding():
    responses = np.concatenate(
        [np.linspace(0, 12, 50_001), np.logspace(-30, 1, 5_001), [-1.0, -50]]
    )
    # One voxel at a time: a kernel of one element gives any response.
    indices = [np.arange(len(responses))]
    line = Occupancy.of_grids(indices, [responses.astype(np.float32)], (1, 1, len(responses)))
    got = observe(line, torch.ones(1, 1, 1)).numpy().reshape(-1)
    expected = np.maximum(0, np.tanh(responses.astype(np.float32).astype(float)))
    units = np.abs(got - expected) / np.spacing(np.maximum(expected, 1e-37).astype(np.float32))
    assert units.max() <= 3
    assert (got <= 1).all()
