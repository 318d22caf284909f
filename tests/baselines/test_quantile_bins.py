"""Trees that are fitted to the bins are those that scikit-learn fits to the features."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.ensemble import HistGradientBoostingClassifier

from scenenet.baselines.boosted_trees import _trees_of
from scenenet.baselines.quantile_bins import BINS, QuantileBins


def features_of(seed: int, rows: int) -> np.ndarray:
    """Features of all kinds: continuous, few values, many ties, skewed, constant, infinite."""
    rng = np.random.default_rng(seed)
    features = np.column_stack([
        rng.normal(size=rows),
        rng.integers(0, 5, rows),
        np.round(rng.normal(size=rows), 2),
        rng.exponential(size=rows) ** 3,
        np.zeros(rows),
        np.where(rng.random(rows) < 0.6, 0, rng.normal(size=rows)),  # most quantiles are equal
        rng.integers(0, 300, rows),
    ]).astype(np.float32)  # fmt: skip
    features[:2, 3] = np.inf
    return features


def fitted(x, y, **more) -> HistGradientBoostingClassifier:
    return HistGradientBoostingClassifier(
        max_iter=25, max_leaf_nodes=16, max_features=0.5, early_stopping=False, random_state=3
    ).fit(x, y, **more)


@pytest.mark.parametrize("rows", [40, 255, 1000, 6000])
@pytest.mark.parametrize("seed", [0, 1])
def test_the_trees_are_those_of_scikit_learn_to_the_last_bit(seed, rows):
    features = features_of(seed, rows)
    rng = np.random.default_rng(seed + 10)
    truth = features[:, 0] + features[:, 2] * features[:, 5] + 0.3 * rng.normal(size=rows) > 0.5
    # Weights that add up exactly put quantiles on rows, others between them.
    weights = np.where(truth, 0.3 * (~truth).sum() / truth.sum() if seed else 4.0, 1.0)
    bins = QuantileBins(features, weights)
    assert bins.thresholds is not None
    assert max(len(thresholds) for thresholds in bins.thresholds) >= min(rows, BINS) // 2
    theirs = _trees_of(fitted(features, truth, sample_weight=weights))
    ours = _trees_of(fitted(bins.numbers(features), truth, sample_weight=weights), bins)
    assert (theirs.feature >= 0).sum() > 10
    for name in ours._fields:
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), err_msg=name)


def test_no_bin_is_empty_and_new_rows_fall_into_the_same_bins():
    features = features_of(2, 3000)
    bins = QuantileBins(features, np.ones(3000))
    numbers = bins.numbers(features)
    for column, thresholds in zip(numbers.T, bins.thresholds, strict=True):
        np.testing.assert_array_equal(np.unique(column), np.arange(len(thresholds) + 1))
    np.testing.assert_array_equal(bins.numbers(features[5:9]), numbers[5:9])


@pytest.mark.parametrize("what", ["NaN", "more rows than are not sampled"])
def test_features_that_scikit_learn_treats_otherwise_are_left_to_it(monkeypatch, what):
    features = features_of(0, 400)
    if what == "NaN":
        features[3, 0] = np.nan
    else:
        monkeypatch.setattr("scenenet.baselines.quantile_bins.SAMPLED_ABOVE", 399)
    bins = QuantileBins(features, np.ones(400))
    assert bins.thresholds is None
    assert bins.numbers(features) is features
    assert bins.threshold(0, 0.25) == 0.25
