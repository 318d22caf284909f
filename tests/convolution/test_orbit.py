"""The maximum over an orbit, compared with the convolution by each of its kernels."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from scenenet.convolution.convolve import convolve, convolve_at_voxels
from scenenet.convolution.occupancy import Occupancy
from scenenet.convolution.orbit import Orbit, strongest, strongest_at_voxels

SHAPE = (7, 9, 8)


def grids(seed: int, valued: bool = False) -> Occupancy:
    rng = np.random.default_rng(seed)
    n = int(np.prod(SHAPE))
    indices = [np.sort(rng.choice(n, size, replace=False)) for size in (60, 0, 25)]
    values = [rng.random(len(i)).astype(np.float32) for i in indices] if valued else None
    return Occupancy.of_grids(indices, values, SHAPE)


def kernels(seed: int, size=(3, 5, 4), n: int = 6) -> torch.Tensor:
    rng = np.random.default_rng(seed)
    full = rng.normal(size=(n, *size)) * (rng.random((n, *size)) < 0.4)
    return torch.from_numpy(full.astype(np.float32))


BY_POSITION, ONE_BY_ONE = 1.0, 0.0
"""Shares of positions that make an orbit stored by position, or convolved one by one."""


@pytest.mark.parametrize("dense", [BY_POSITION, ONE_BY_ONE])
@pytest.mark.parametrize("valued", [False, True])
@pytest.mark.parametrize("size", [(3, 5, 4), (1, 1, 1), (9, 11, 13)])
def test_it_is_the_maximum_of_the_convolutions(size, valued, dense):
    occupancy, several = grids(1, valued), kernels(2, size)
    expected = convolve_at_voxels(occupancy, several).max(dim=0).values.numpy()
    orbit = Orbit.of(several, dense)
    assert (orbit.kernels is None) == (dense == BY_POSITION)
    found = strongest_at_voxels(occupancy, orbit)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("dense", [BY_POSITION, ONE_BY_ONE])
def test_a_second_half_turn_that_repeats_the_first_is_not_computed(dense):
    occupancy, several = grids(1), kernels(2)
    once, twice = Orbit.of(several, dense), Orbit.of(torch.cat([several, several]), dense)
    assert once.n == twice.n
    assert np.array_equal(*(strongest_at_voxels(occupancy, orbit) for orbit in (once, twice)))
    assert Orbit.of(torch.cat([several, -several]), dense).n == 2 * once.n


@pytest.mark.parametrize("dense", [BY_POSITION, ONE_BY_ONE])
def test_it_answers_at_other_voxels(dense):
    occupancy, several = grids(3), kernels(4)
    at = np.sort(np.random.default_rng(5).choice(3 * int(np.prod(SHAPE)), 50, replace=False))
    expected = strongest(occupancy, several).reshape(-1)[torch.from_numpy(at)].numpy()
    found = strongest_at_voxels(occupancy, Orbit.of(several, dense), at)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


def test_its_gradient_is_that_of_the_winner():
    occupancy, several = grids(6), kernels(7).double().requires_grad_(True)
    weights = torch.from_numpy(np.random.default_rng(8).normal(size=(3, *SHAPE)))
    (strongest(occupancy, several) * weights).sum().backward()
    found = several.grad.clone()
    several.grad = None
    (convolve(occupancy, several).max(dim=0).values * weights).sum().backward()
    torch.testing.assert_close(found, several.grad)


def test_a_measurement_of_zero_is_an_empty_voxel():
    occupancy = grids(9)
    phi = np.random.default_rng(10).random(len(occupancy.index)).astype(np.float32)
    phi[::3] = 0
    measured = occupancy.measured(phi)
    assert len(measured.index) == np.count_nonzero(phi)
    dense = measured.dense().numpy().reshape(-1)
    np.testing.assert_array_equal(dense[occupancy.flat()], phi)
