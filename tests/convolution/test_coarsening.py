"""A fine grid observed in blocks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenenet.convolution.coarsening import block_edge, coarsened
from scenenet.convolution.occupancy import Occupancy


@pytest.mark.parametrize(
    ("voxel_size", "edge"), [(2.0, 1), (1.0, 1), (0.8, 1), (0.5, 2), (0.33, 3), (0.25, 4)]
)
def test_a_block_is_about_a_metre(voxel_size, edge):
    assert block_edge(voxel_size) == edge


@given(st.integers(0, 500), st.integers(1, 4))
def test_a_block_is_occupied_if_any_of_its_voxels_is(seed, edge):
    rng = np.random.default_rng(seed)
    shape = (5, 7, 6)
    volumes = [rng.random(shape) < 0.1 for _ in range(2)]
    values = [rng.random(int(v.sum())).astype(np.float32) for v in volumes]
    occupancy = Occupancy.of_grids([np.flatnonzero(v) for v in volumes], values, shape)
    coarse, rows = coarsened(occupancy, edge)
    assert coarse.shape == tuple(-(-side // edge) for side in shape)
    dense, fine = coarse.dense().numpy(), occupancy.dense().numpy()
    for b, z, y, x in np.ndindex(dense.shape):
        block = fine[b, *(slice(i * edge, (i + 1) * edge) for i in (z, y, x))]
        assert dense[b, z, y, x] == block.max()
    places = np.stack(np.unravel_index(occupancy.flat(), (2, *shape)), axis=1)
    blocks = np.stack(np.unravel_index(coarse.flat(), (2, *coarse.shape)), axis=1)
    places[:, 1:] //= edge
    np.testing.assert_array_equal(blocks[rows], places)


def test_blocks_of_one_voxel_are_the_grid_itself():
    occupancy = Occupancy.of_grids([np.array([3, 5])], None, (2, 2, 2))
    coarse, rows = coarsened(occupancy, 1)
    assert coarse is occupancy
    assert rows.tolist() == [0, 1]
