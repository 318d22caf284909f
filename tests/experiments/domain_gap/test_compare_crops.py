"""Synthetic beside real: the comparison itself, and where real crops are at hand its outcome."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from scenenet.core.errors import InputError
from scenenet.experiments.domain_gap.compare_crops import (
    beside,
    markdown,
    measure,
    real_crops,
    synthetic_crops,
    tell_apart,
    tell_voxels_apart,
)
from scenenet.synthetic import SyntheticSettings

SPARSE = {"towers": 8, "density": 20.0, "tower_density": 20.0}


@pytest.fixture(scope="module")
def measured():
    """Two sets of synthetic crops: of the same kind and of a bare one."""
    kinds = ({"seed": 1}, {"seed": 2}, {"seed": 2, "tree_cover": 0.0, "bush_cover": 0.0})
    return [measure(synthetic_crops(SyntheticSettings(**SPARSE, **kind))) for kind in kinds]


def test_crops_come_through_the_chain(measured):
    for some in measured:
        assert len(some.properties) == len(some.grids) == SPARSE["towers"]
        assert len(some.voxels) == len(some.crop)
        assert np.isfinite(some.voxels).all()


def test_what_is_alike_cannot_be_told_apart_and_what_differs_can(measured):
    first, alike, bare = measured
    voxels, _ = tell_voxels_apart(first, alike)
    assert voxels.auc < 0.7
    voxels, crops = tell_voxels_apart(first, bare)
    assert voxels.auc > 0.6
    assert crops.auc > 0.8
    test = tell_apart(first.properties, bare.properties)
    assert test.auc > 0.7
    assert {"canopy_cover", "tall_density", "class_12"} & set(test.features.index[:8])


def test_the_table_says_what_is_in_range(measured):
    first, _, bare = measured
    table = beside(first.properties, bare.properties).set_index("property")
    assert table.loc["tower_height", "within"]
    assert not table.loc["tall_density", "within"]
    text = markdown(table.reset_index(), {}, (8, 8))
    assert text.count("\n| ") >= len(table)
    assert "**no**" in text


def test_what_holds_no_samples_is_refused(tmp_path):
    with pytest.raises(InputError, match="no TS40K sample"):
        next(real_crops(tmp_path))
    with pytest.raises(InputError, match="no TS40K sample"):
        next(real_crops(tmp_path / "survey.laz"))


@pytest.mark.parametrize("module", ["realism", "transfer"])
def test_the_command_says_what_it_does(module):
    shown = subprocess.run(
        [sys.executable, "-m", f"scenenet.{module}", "--help"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "--real" in shown.stdout


def test_default_corridors_are_like_the_public_crops(real_data):
    real = measure(real_crops(real_data / "ts40k"))
    synthetic = measure(synthetic_crops(SyntheticSettings(towers=24, seed=5)))
    table = beside(real.properties, synthetic.properties)
    outside = table.loc[~table["within"], "property"].tolist()
    assert len(outside) <= 4, outside
    voxels, _ = tell_voxels_apart(real, synthetic)
    assert voxels.auc < 0.7


def test_one_number_tells_apart_what_lies_apart():
    left = pd.DataFrame({"a": np.arange(10.0), "b": np.ones(10)})
    right = pd.DataFrame({"a": 100 + np.arange(30.0), "b": np.ones(30)})
    test = tell_apart(left, right)
    assert test.auc > 0.99
    assert test.features["a"] == 1.0
    assert test.features["b"] == 0.5
