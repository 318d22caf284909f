"""The strongest response in the cross-section of a tower."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenenet.convolution.cross_section import (
    highest,
    neighbours,
    section_offsets,
    strongest,
    whole_voxels,
)
from scenenet.convolution.occupancy import Occupancy

SHAPE = (5, 6, 7)


def occupied(*volumes: np.ndarray) -> Occupancy:
    return Occupancy.of_grids([np.flatnonzero(v) for v in volumes], None, volumes[0].shape)


def of_volume(
    occupancy: Occupancy, responses: np.ndarray, radius: float, above: float
) -> np.ndarray:
    section = neighbours(occupancy, section_offsets(radius, above, 1.0))
    found = responses[strongest(responses, *section)]
    np.testing.assert_array_equal(highest(responses, *section), found)
    return found


@pytest.mark.parametrize(
    ("length", "voxel_size", "n"), [(6.0, 1.0, 6), (0.9, 1.0, 0), (0.6, 0.2, 3), (2.1, 0.7, 3)]
)
def test_lengths_are_rounded_down_to_whole_voxels(length, voxel_size, n):
    assert whole_voxels(length, voxel_size) == n


def test_a_section_is_a_disc_from_the_voxel_up():
    offsets = section_offsets(1.0, 2.0, 1.0)
    assert offsets[0].tolist() == [0, 0, 0]
    assert len(offsets) == 3 * 5
    assert set(offsets[:, 0]) == {0, 1, 2}
    assert (offsets[:, 1] ** 2 + offsets[:, 2] ** 2 <= 1).all()


def test_half_the_voxel_size_is_twice_the_voxels():
    assert section_offsets(2.0, 1.0, 0.5).max() == 4
    assert section_offsets(2.0, 1.0, 0.5)[:, 0].max() == 2


@given(st.integers(0, 500), st.floats(0, 3), st.floats(0, 2))
def test_it_is_the_maximum_over_the_occupied_voxels_of_the_section(seed, radius, above):
    rng = np.random.default_rng(seed)
    volumes = [rng.random(SHAPE) < 0.3 for _ in range(2)]
    occupancy = occupied(*volumes)
    responses = rng.normal(size=len(occupancy.index)).astype(np.float32)
    places = np.stack(np.unravel_index(occupancy.flat(), (2, *SHAPE)), axis=1)
    expected = []
    for grid, z, y, x in places:
        apart = places - [grid, z, y, x]
        inside = (apart[:, 0] == 0) & (apart[:, 1] >= 0) & (apart[:, 1] <= above)
        inside &= apart[:, 2] ** 2 + apart[:, 3] ** 2 <= (radius + 1e-6) ** 2
        expected.append(responses[inside].max())
    np.testing.assert_array_equal(of_volume(occupancy, responses, radius, above), expected)


@given(st.integers(0, 500))
def test_it_does_not_increase_differences(seed):
    rng = np.random.default_rng(seed)
    occupancy = occupied(rng.random(SHAPE) < 0.3)
    one, other = rng.normal(size=(2, len(occupancy.index)))
    after = [of_volume(occupancy, a, 2.0, 1.0) for a in (one, other)]
    assert np.abs(after[0] - after[1]).max() <= np.abs(one - other).max() + 1e-12


def test_an_empty_grid_has_no_cross_sections():
    empty = occupied(np.zeros(SHAPE, bool))
    starts, rows = neighbours(empty, section_offsets(2.0, 1.0, 1.0))
    assert starts.tolist() == [0]
    assert len(rows) == 0
