"""Gaussian means at some cells of a raster."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from scenenet.clearance.gaussian import gaussian_at


@pytest.mark.parametrize("shape", [(40, 31), (3, 90), (2, 2)])
@pytest.mark.parametrize("width", [1.0, 8.0, 32.0])
def test_means_are_those_of_the_whole_raster_to_the_bit(shape, width):
    rng = np.random.default_rng(5)
    raster = np.where(rng.random(shape) < 0.4, 0.0, rng.normal(0, 100, shape))
    rows, columns = np.nonzero(rng.random(shape) < 0.5)
    whole = ndimage.gaussian_filter(raster, width, mode="constant")
    np.testing.assert_array_equal(gaussian_at(raster, width, (rows, columns)), whole[rows, columns])
