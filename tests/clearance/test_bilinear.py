"""Values between the cells of a raster."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from scenenet.clearance.bilinear import bilinear_at


@pytest.mark.parametrize("shape", [(40, 31), (3, 90), (2, 2)])
def test_values_are_those_of_scipy_to_the_bit_also_beyond_the_border(shape):
    rng = np.random.default_rng(5)
    raster, corner = rng.normal(100, 5, shape), np.array([544_000.5, 4_634_000.5])
    xy = corner + rng.uniform(-20, 110, (20_000, 2))
    xy[:500] = np.round(xy[:500])  # on borders of cells
    xy[500:1000] = np.floor(xy[500:1000]) + 0.5  # on their centres
    at = (xy - corner).T[::-1]
    expected = ndimage.map_coordinates(raster, at, order=1, mode="nearest")
    np.testing.assert_array_equal(bilinear_at(raster, corner, 1.0, xy), expected)
