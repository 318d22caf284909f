"""The lowest and the highest of columns."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.core.extent import extent


@pytest.mark.parametrize("columns", [2, 3])
def test_extent_is_that_of_each_column(columns):
    places = np.random.default_rng(0).normal(size=(50, columns))
    low, high = extent(places)
    assert (low == places.min(axis=0)).all()
    assert (high == places.max(axis=0)).all()
