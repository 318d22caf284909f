"""The occupancy convolution is the dense one, and moves with the scene."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from scenenet.convolution import Occupancy, convolve

# torch says that an even size costs it a copy.
pytestmark = pytest.mark.filterwarnings("ignore:Using padding='same'")

sizes = st.tuples(*[st.integers(1, 7)] * 3)
shapes = st.tuples(*[st.integers(1, 9)] * 3)


def grids(shape, n_grids: int, share: float, seed: int, dtype=np.float64) -> Occupancy:
    """``n_grids`` random grids with values in [0, 1]."""
    rng = np.random.default_rng(seed)
    indices = [np.flatnonzero(rng.random(shape).ravel() < share) for _ in range(n_grids)]
    made = Occupancy.of_grids(indices, [rng.random(len(i)) for i in indices], shape)
    return Occupancy(made.zyx, rng.random(len(made.zyx)).astype(dtype), made.offsets, shape)


def dense_convolution(occupancy: Occupancy, kernel: torch.Tensor) -> torch.Tensor:
    volume = occupancy.dense()[:, None]
    return torch.nn.functional.conv3d(volume, kernel[None, None], padding="same")[:, 0]


@given(shapes, sizes, st.integers(0, 3), st.sampled_from([0.0, 0.1, 0.7, 1.0]), st.integers(0, 99))
def test_it_is_conv3d_for_any_shape_and_kernel_size(shape, size, n_grids, share, seed):
    occupancy = grids(shape, n_grids, share, seed)
    kernel = torch.from_numpy(np.random.default_rng(seed).normal(size=size))
    answer = convolve(occupancy, kernel)
    assert answer.shape == (n_grids, *shape)
    if n_grids:
        torch.testing.assert_close(answer, dense_convolution(occupancy, kernel), rtol=0, atol=1e-12)


@given(shapes, sizes, st.integers(0, 99))
def test_float32_is_as_near_as_float32_can_be(shape, size, seed):
    occupancy = grids(shape, 2, 0.3, seed, np.float32)
    kernel = torch.from_numpy(np.random.default_rng(seed).normal(size=size).astype(np.float32))
    answer = convolve(occupancy, kernel)
    assert answer.dtype == torch.float32
    torch.testing.assert_close(answer, dense_convolution(occupancy, kernel), rtol=1e-5, atol=1e-5)


@given(shapes, sizes, st.integers(0, 99))
def test_its_gradient_is_that_of_conv3d(shape, size, seed):
    occupancy = grids(shape, 2, 0.3, seed)
    rng = np.random.default_rng(seed)
    weight = torch.from_numpy(rng.normal(size=(2, *shape)))
    gradients = []
    for convolution in (convolve, dense_convolution):
        kernel = torch.from_numpy(np.random.default_rng(seed).normal(size=size)).requires_grad_()
        (convolution(occupancy, kernel).tanh() * weight).sum().backward()
        gradients.append(kernel.grad)
    torch.testing.assert_close(*gradients, rtol=0, atol=1e-11)


@pytest.mark.parametrize("size", [(3, 3, 3), (4, 2, 3), (1, 1, 1)])
def test_gradcheck(size):
    occupancy = grids((4, 5, 3), 2, 0.4, seed=1)
    kernel = torch.from_numpy(np.random.default_rng(1).normal(size=size)).requires_grad_()
    assert torch.autograd.gradcheck(lambda k: convolve(occupancy, k), [kernel])


def test_one_voxel_spreads_the_mirrored_kernel_around_itself():
    kernel = torch.arange(1.0, 4.0).reshape(1, 1, 3)
    one = Occupancy.of_grids([np.array([2])], [np.ones(1)], (1, 1, 5))
    assert convolve(one, kernel).tolist() == [[[[0.0, 3.0, 2.0, 1.0, 0.0]]]]


def test_an_even_kernel_reaches_one_voxel_further_up():
    kernel = torch.tensor([1.0, 10.0]).reshape(1, 1, 2)
    one = Occupancy.of_grids([np.array([2])], [np.ones(1)], (1, 1, 5))
    # out[p] = kernel[0] x[p] + kernel[1] x[p + 1]: no answer between two voxels
    assert convolve(one, kernel).tolist() == [[[[0.0, 10.0, 1.0, 0.0, 0.0]]]]


@given(sizes, st.tuples(*[st.integers(0, 5)] * 3), st.integers(0, 99))
def test_a_translated_scene_gives_the_translated_answer(size, shift, seed):
    scene = grids((5, 4, 6), 1, 0.3, seed)
    room, margin = (24, 24, 24), 6  # so that nothing reaches the border
    placed = [
        Occupancy((scene.zyx + offset).astype(np.int32), scene.values, scene.offsets, room)
        for offset in (np.full(3, margin), margin + np.array(shift))
    ]
    kernel = torch.from_numpy(np.random.default_rng(seed).normal(size=size))
    here, there = (convolve(p, kernel) for p in placed)
    moved = torch.roll(here, shift, dims=(1, 2, 3))
    torch.testing.assert_close(there, moved, rtol=0, atol=1e-12)


@given(st.permutations(range(4)), st.integers(0, 99))
def test_each_grid_of_a_batch_is_answered_by_itself(order, seed):
    rng = np.random.default_rng(seed)
    shape = (4, 5, 3)
    indices = [np.flatnonzero(rng.random(60) < share) for share in (0.0, 0.1, 0.5, 0.9)]
    values = [np.ones(len(i)) for i in indices]
    kernel = torch.from_numpy(rng.normal(size=(3, 3, 3)))
    together = convolve(Occupancy.of_grids(indices, values, shape), kernel)
    permuted = Occupancy.of_grids([indices[i] for i in order], [values[i] for i in order], shape)
    assert torch.equal(convolve(permuted, kernel), together[list(order)])
    alone = Occupancy.of_grids(indices[2:3], values[2:3], shape)
    assert torch.equal(convolve(alone, kernel)[0], together[2])


@given(st.floats(-3, 3), st.integers(0, 99))
def test_it_is_linear_in_the_kernel(factor, seed):
    occupancy = grids((4, 5, 3), 2, 0.4, seed)
    rng = np.random.default_rng(seed)
    a, b = (torch.from_numpy(rng.normal(size=(3, 3, 3))) for _ in range(2))
    torch.testing.assert_close(
        convolve(occupancy, a + factor * b),
        convolve(occupancy, a) + factor * convolve(occupancy, b),
        rtol=0,
        atol=1e-12,
    )


def test_the_dense_form_has_each_value_in_its_place():
    made = Occupancy.of_grids([np.array([0, 5]), np.array([23])], [[0.5, 1.0], [0.25]], (2, 3, 4))
    dense = made.dense()
    assert len(made) == 2
    assert dense[0, 0, 0, 0] == 0.5
    assert dense[0, 0, 1, 1] == 1.0
    assert dense[1, 1, 2, 3] == 0.25
    assert dense.sum() == 1.75
