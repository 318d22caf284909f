"""The parameters that were published with the code of the thesis."""

from __future__ import annotations

import pytest

from scenenet.models.published_weights import WEIGHTS, published_scenenet


def test_the_model_has_the_published_numbers():
    model = published_scenenet()
    assert model.kernel_size == (9, 5, 5)
    assert model.shape_parameters() == pytest.approx(WEIGHTS, abs=1e-5)
    assert model.n_parameters() == 11
