"""The comparison of synthetic with real crops, and its result if real crops are available."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fixtures.forked import command_line
from sklearn.utils import compute_sample_weight

from scenenet.baselines.quantile_bins import QuantileBins
from scenenet.core.errors import InputError
from scenenet.experiments.domain_gap import compare_crops
from scenenet.experiments.domain_gap.compare_crops import (
    compare_properties,
    crop_separability,
    markdown,
    measure,
    real_crops,
    synthetic_crops,
    voxel_separability,
)
from scenenet.synthetic import SyntheticSettings

NAME = "scenenet.experiments.domain_gap."
SPARSE = {"towers": 8, "density": 20.0, "tower_density": 20.0}


@pytest.fixture(scope="module")
def measured():
    """Two sets of synthetic crops: of the same kind and of a bare one."""
    kinds = ({"seed": 1}, {"seed": 2}, {"seed": 2, "tree_cover": 0.0, "bush_cover": 0.0})
    return [measure(synthetic_crops(SyntheticSettings(**SPARSE, **kind))) for kind in kinds]


def test_crops_are_cut_by_the_stages_of_a_survey(measured):
    for some in measured:
        assert len(some.properties) == len(some.grids) == SPARSE["towers"]
        assert len(some.voxels) == len(some.crop)
        assert np.isfinite(some.voxels).all()


def test_similar_crops_are_not_separable_and_different_ones_are(measured):
    first, similar, bare = measured
    voxels, _ = voxel_separability(first, similar, repeats=1)
    assert voxels.auc < 0.7
    voxels, crops = voxel_separability(first, bare, repeats=1)
    assert voxels.auc > 0.6
    assert crops.auc > 0.8
    test = crop_separability(first.properties, bare.properties, repeats=2)
    assert test.auc > 0.7
    assert {"canopy_cover", "tall_density", "class_12"} & set(test.features.index[:8])


def test_the_table_shows_which_properties_are_in_range(measured):
    first, _, bare = measured
    table = compare_properties(first.properties, bare.properties).set_index("property")
    assert table.loc["tower_height", "within"]
    assert not table.loc["tall_density", "within"]
    text = markdown(table.reset_index(), {}, (8, 8))
    assert text.count("\n| ") >= len(table)
    assert "**no**" in text


def test_a_folder_without_samples_is_refused(tmp_path):
    with pytest.raises(InputError, match="no TS40K sample"):
        next(real_crops(tmp_path))
    with pytest.raises(InputError, match="no TS40K sample"):
        next(real_crops(tmp_path / "survey.laz"))


@pytest.mark.parametrize("module", ["compare_crops", "transfer"])
def test_the_command_has_a_help_text(module):
    program = f"import runpy; runpy.run_module({NAME + module!r}, run_name='__main__')"
    shown = command_line().call(program, ["--help"], Path.cwd(), os.environ, 600)
    assert shown.returncode == 0, shown.stderr
    assert "--real" in shown.stdout


def test_default_corridors_are_like_the_public_crops(real_data):
    real = measure(real_crops(real_data / "ts40k"))
    synthetic = measure(synthetic_crops(SyntheticSettings(towers=24, seed=5)))
    table = compare_properties(real.properties, synthetic.properties)
    outside = table.loc[~table["within"], "property"].tolist()
    assert len(outside) <= 4, outside
    voxels, _ = voxel_separability(real, synthetic, repeats=1)
    assert voxels.auc < 0.7


def test_one_differing_property_is_enough_to_separate():
    left = pd.DataFrame({"a": np.arange(10.0), "b": np.ones(10)})
    right = pd.DataFrame({"a": 100 + np.arange(30.0), "b": np.ones(30)})
    test = crop_separability(left, right, repeats=2)
    assert test.auc > 0.99
    assert test.features["a"] == 1.0
    assert test.features["b"] == 0.5


@pytest.mark.parametrize("rows", [3000, 12_000])
def test_the_bins_of_the_voxels_give_the_classifier_of_scikit_learn(rows):
    rng = np.random.default_rng(rows)
    features = np.round(rng.normal(size=(rows, 4)), 3)
    real = (features[:, 0] * features[:, 1] + rng.normal(size=rows) > 1).astype(int)
    kept = compare_crops._not_held_out(real)
    bins = QuantileBins(features[kept], compute_sample_weight("balanced", real)[kept])
    theirs = compare_crops._classifier(200).fit(features, real)
    ours = compare_crops._classifier(200).fit(bins.numbers(features), real)
    assert (len(kept) < rows) == theirs.do_early_stopping_
    np.testing.assert_array_equal(
        ours.decision_function(bins.numbers(features)), theirs.decision_function(features)
    )
