"""The bins in which scikit-learn's boosted trees look for splits, found fast.

``HistGradientBoostingClassifier`` divides each feature at weighted quantiles and then only knows
the number of the bin. With weights it sorts a feature anew for each of 254 quantiles, which takes
two thirds of a training. Here each feature is sorted once. Trees that are fitted to the numbers of
these bins are those that are fitted to the features, to the last bit.
"""

from __future__ import annotations

import numpy as np

BINS = 255
"""Of a feature, at most: the default of scikit-learn."""
LARGEST_THRESHOLD = 1e300
"""Of scikit-learn, so that infinity is in a bin of its own."""
SAMPLED_ABOVE = 200_000
"""Rows above which scikit-learn takes the quantiles of a random sample, which is fast."""


class QuantileBins:
    """The bins of some features.

    Attributes:
        thresholds: for each feature the upper bounds (B - 1,) of its B bins but the last,
            ascending. No bin is empty. None where scikit-learn has to divide the features itself:
            with more rows than ``SAMPLED_ABOVE``, and with NaN.
    """

    def __init__(self, features: np.ndarray, weights: np.ndarray) -> None:
        """Divide features (M, F) of rows of weight (M,), all above 0."""
        self.thresholds: list[np.ndarray] | None = None
        if len(features) <= SAMPLED_ABOVE and not np.isnan(features).any():
            columns = np.ascontiguousarray(features.T, np.float64)
            self.thresholds = [_thresholds(column, weights) for column in columns]

    def numbers(self, features: np.ndarray) -> np.ndarray:
        """What to fit to: the number of the bin of each feature, (M, F) float64; without thresholds
        the features themselves."""
        if self.thresholds is None:
            return features
        columns = np.ascontiguousarray(features.T, np.float64)
        each = zip(self.thresholds, columns, strict=True)
        return np.stack([np.searchsorted(t, column) for t, column in each], axis=1).astype(float)

    def threshold(self, feature: int, number: float) -> float:
        """The value at which a split at ``number``, between two bins, divides a feature."""
        return number if self.thresholds is None else self.thresholds[feature][int(number)]


def _thresholds(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    order = np.argsort(values)
    values, weights = values[order], weights[order]
    distinct = np.unique(values)
    if len(distinct) <= BINS:
        return np.minimum((distinct[:-1] + distinct[1:]) / 2, LARGEST_THRESHOLD)
    # Hyndman and Fan's averaged inverse of the distribution, as scikit-learn calculates it. It
    # sorts again, which may reorder equal values and so the sums of their weights.
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    wanted = np.linspace(0, 100, BINS + 1)[1:-1] / 100 * below[-1]
    last = len(values) - 1
    at = np.clip(np.searchsorted(below, wanted), 0, last)
    between = below[at] - wanted > np.finfo(float).eps
    after = values[np.clip(at + 1, 0, last)]
    found = np.unique(np.where(between, values[at], (values[at] + after) / 2))
    found = np.minimum(found, LARGEST_THRESHOLD)
    # A split above an empty bin is the one below it, which scikit-learn takes.
    return found[np.unique(np.searchsorted(found, values))[:-1]]
