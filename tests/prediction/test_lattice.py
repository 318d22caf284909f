"""The lattice of voxels: where points are, and which are in one tile."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.dataset.voxels import BORDER_M
from scenenet.prediction.work.lattice import EDGE, Lattice, code_of, groups


def points(n: int = 5000) -> np.ndarray:
    """(n, 3) m, a walk over the origin, so that neighbours are mostly in one tile."""
    return np.cumsum(np.random.default_rng(3).normal(0, 2, (n, 3)), axis=0)


@pytest.mark.parametrize("size", [0.6, 1.0])
def test_a_point_is_in_the_voxel_that_covers_it(size):
    xyz = points()
    codes, voxels = Lattice(size).locate(xyz)
    step = np.floor((xyz + BORDER_M) / size).astype(int)
    assert codes.tolist() == [code_of(tuple(place)) for place in step[:, ::-1] // EDGE]
    x, y, z = (step % EDGE).T
    np.testing.assert_array_equal(voxels, (z * EDGE + y) * EDGE + x)


@pytest.mark.parametrize("far", [np.nan, 1e12, -1e12])
def test_the_first_point_outside_the_lattice_is_named(far):
    xyz = points()
    xyz[[700, 900], [1, 0]] = far
    with pytest.raises(InputError, match="too far from the origin") as error:
        Lattice(1.0).locate(xyz)
    assert str(xyz[700, 0]) in str(error.value)


@pytest.mark.parametrize("codes", [[], [7], [5, 5, 2, 2, 5, 9, 2], list(range(40, 0, -1))])
def test_groups_have_the_rows_of_each_code_in_order(codes):
    found = [(code, rows.tolist()) for code, rows in groups(np.array(codes, np.int64))]
    assert found == [
        (code, np.flatnonzero(np.array(codes) == code).tolist()) for code in sorted(set(codes))
    ]
