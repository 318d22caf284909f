"""The convolution over occupied voxels equals the dense one and is equivariant."""

from __future__ import annotations

import numba
import numpy as np
import pytest
import torch
from fixtures.dense import convolve_dense
from hypothesis import given
from hypothesis import strategies as st

from scenenet.convolution.convolve import convolve, convolve_at_voxels
from scenenet.convolution.occupancy import Occupancy

# torch warns that an even size needs a copy.
pytestmark = pytest.mark.filterwarnings("ignore:Using padding='same'")

# Wide enough for runs of voxels that end within a row and at its end, and kernels that need more
# than one vector row.
sizes = st.tuples(st.integers(1, 7), st.integers(1, 7), st.integers(1, 21))
shapes = st.tuples(st.integers(1, 9), st.integers(1, 9), st.integers(1, 23))


def grids(
    shape, n_grids: int, share: float, seed: int, dtype=np.float64, valued: bool = True
) -> Occupancy:
    """``n_grids`` random grids with values in [0, 1], or with ones."""
    rng = np.random.default_rng(seed)
    indices = [np.flatnonzero(rng.random(shape).ravel() < share) for _ in range(n_grids)]
    if not valued:
        return Occupancy.of_grids(indices, None, shape)
    return Occupancy.of_grids(indices, [rng.random(len(i)).astype(dtype) for i in indices], shape)


def dense_convolution(occupancy: Occupancy, kernel: torch.Tensor) -> torch.Tensor:
    volume = occupancy.dense(kernel.dtype)[:, None]
    return torch.nn.functional.conv3d(volume, kernel[None, None], padding="same")[:, 0]


@given(
    shapes, sizes, st.integers(0, 3), st.sampled_from([0.0, 0.1, 0.7, 1.0]), st.booleans(),
    st.integers(0, 99),
)  # fmt: skip
def test_it_equals_conv3d_for_any_shape_and_kernel_size(shape, size, n_grids, share, valued, seed):
    occupancy = grids(shape, n_grids, share, seed, valued=valued)
    kernel = torch.from_numpy(np.random.default_rng(seed).normal(size=size))
    response = convolve(occupancy, kernel)
    assert response.shape == (n_grids, *shape)
    if n_grids:
        expected = dense_convolution(occupancy, kernel)
        torch.testing.assert_close(response, expected, rtol=0, atol=1e-11)
        torch.testing.assert_close(convolve_dense(occupancy, kernel), expected, rtol=0, atol=1e-11)


@given(shapes, sizes, st.booleans(), st.integers(0, 99))
def test_the_error_in_float32_is_rounding(shape, size, valued, seed):
    occupancy = grids(shape, 2, 0.3, seed, np.float32, valued)
    kernel = torch.from_numpy(np.random.default_rng(seed).normal(size=size).astype(np.float32))
    response = convolve(occupancy, kernel)
    assert response.dtype == torch.float32
    torch.testing.assert_close(response, dense_convolution(occupancy, kernel), rtol=1e-5, atol=2e-5)


@pytest.mark.parametrize("resolution", [64, 128])
@pytest.mark.parametrize("size", [(9, 9, 9), (9, 5, 5), (12, 5, 5)])
def test_it_equals_conv3d_at_the_usual_sizes(resolution, size):
    occupancy = grids((resolution,) * 3, 1, 0.01, seed=3, valued=False)
    kernel = torch.from_numpy(np.random.default_rng(1).normal(size=size).astype(np.float32))
    response, expected = convolve(occupancy, kernel), dense_convolution(occupancy, kernel)
    torch.testing.assert_close(response, expected, rtol=1e-5, atol=2e-5)


@given(shapes, sizes, st.booleans(), st.integers(0, 99))
def test_responses_at_the_occupied_voxels_are_those_of_the_volume(shape, size, valued, seed):
    occupancy = grids(shape, 2, 0.3, seed, valued=valued)
    kernels = torch.from_numpy(np.random.default_rng(seed).normal(size=(3, *size)))
    volumes = convolve(occupancy, kernels)
    assert volumes.shape == (3, 2, *shape)
    expected = volumes.reshape(3, -1)[:, torch.from_numpy(occupancy.flat())]
    assert torch.equal(convolve_at_voxels(occupancy, kernels), expected)


@given(shapes, sizes, st.booleans(), st.integers(0, 99))
def test_its_gradient_is_that_of_conv3d(shape, size, valued, seed):
    occupancy = grids(shape, 2, 0.3, seed, valued=valued)
    rng = np.random.default_rng(seed)
    weight = torch.from_numpy(rng.normal(size=(2, *shape)))
    gradients = []
    for convolution in (convolve, dense_convolution):
        kernel = torch.from_numpy(np.random.default_rng(seed).normal(size=size)).requires_grad_()
        (convolution(occupancy, kernel).tanh() * weight).sum().backward()
        gradients.append(kernel.grad)
    torch.testing.assert_close(*gradients, rtol=0, atol=1e-10)


@pytest.mark.parametrize("valued", [True, False])
@pytest.mark.parametrize("size", [(3, 3, 3), (4, 2, 3), (1, 1, 1)])
def test_gradcheck(size, valued):
    occupancy = grids((4, 5, 6), 2, 0.4, seed=1, valued=valued)
    kernel = torch.from_numpy(np.random.default_rng(1).normal(size=size)).requires_grad_()
    assert torch.autograd.gradcheck(lambda k: convolve(occupancy, k), [kernel])


def test_one_voxel_spreads_the_mirrored_kernel_around_itself():
    kernel = torch.arange(1.0, 4.0).reshape(1, 1, 3)
    one = Occupancy.of_grids([np.array([2])], [np.ones(1)], (1, 1, 5))
    assert convolve(one, kernel).tolist() == [[[[0.0, 3.0, 2.0, 1.0, 0.0]]]]


def test_an_even_kernel_extends_one_voxel_further_up():
    kernel = torch.tensor([1.0, 10.0]).reshape(1, 1, 2)
    one = Occupancy.of_grids([np.array([2])], [np.ones(1)], (1, 1, 5))
    # out[p] = kernel[0] x[p] + kernel[1] x[p + 1]: no response between two voxels
    assert convolve(one, kernel).tolist() == [[[[0.0, 10.0, 1.0, 0.0, 0.0]]]]


@given(sizes, st.tuples(*[st.integers(0, 5)] * 3), st.integers(0, 99))
def test_a_translated_scene_gives_the_translated_response(size, shift, seed):
    scene = grids((5, 4, 6), 1, 0.3, seed)
    room, margin = (24, 24, 48), np.array([7, 7, 14])  # so that nothing reaches the border
    zyx = np.stack(np.unravel_index(scene.index, scene.shape))
    placed = [
        Occupancy.of_grids(
            [np.ravel_multi_index(tuple(zyx + offset[:, None]), room)], [scene.values], room
        )
        for offset in (margin, margin + np.array(shift))
    ]
    kernel = torch.from_numpy(np.random.default_rng(seed).normal(size=size))
    here, there = (convolve(p, kernel) for p in placed)
    moved = torch.roll(here, shift, dims=(1, 2, 3))
    torch.testing.assert_close(there, moved, rtol=0, atol=1e-11)


@given(st.permutations(range(4)), st.integers(0, 99))
def test_the_grids_of_a_batch_are_independent(order, seed):
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


def test_the_dense_volume_has_each_value_at_its_position():
    made = Occupancy.of_grids([np.array([0, 5]), np.array([23])], [[0.5, 1.0], [0.25]], (2, 3, 4))
    dense = made.dense()
    assert len(made) == 2
    assert dense[0, 0, 0, 0] == 0.5
    assert dense[0, 0, 1, 1] == 1.0
    assert dense[1, 1, 2, 3] == 0.25
    assert dense.sum() == 1.75


@pytest.mark.parametrize("index", [[3, 2], [2, 2], [-1], [24]])
def test_positions_out_of_order_or_outside_the_grid_are_refused(index):
    with pytest.raises(ValueError, match="ascending"):
        Occupancy.of_grids([np.array([0]), np.array(index)], None, (2, 3, 4))


def test_the_response_does_not_depend_on_the_number_of_cores():
    occupancy = grids((64, 64, 64), 2, 0.01, seed=0, valued=False)
    responses, gradients = [], []
    before = numba.get_num_threads()
    for threads in (1, before):
        numba.set_num_threads(threads)
        kernel = torch.from_numpy(np.random.default_rng(0).normal(size=(9, 5, 5))).float()
        kernel.requires_grad_()
        responses.append(convolve(occupancy, kernel))
        responses[-1].square().sum().backward()
        gradients.append(kernel.grad)
    numba.set_num_threads(before)
    assert torch.equal(*responses)
    assert torch.equal(*gradients)
