"""Choosing tau where false voxels on the crops at hand understate those elsewhere."""

from __future__ import annotations

import numpy as np

from scenenet.metrics.score_columns import BETA
from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve


def _coarse_steps() -> np.ndarray:
    observed = np.arctanh(THRESHOLDS)
    wanted = np.exp(np.arange(np.log(observed[0]), np.log(observed[-1]), APART))
    return np.unique(np.searchsorted(observed, wanted * (1 - 1e-9)))


APART = 0.05
"""Share by which the thresholds that are tried differ in the observer's answer."""
STEPS = _coarse_steps()
"""Their numbers in ``scenenet.metrics.threshold_curve.THRESHOLDS``, ascending."""


def best_step(curve: ThresholdCurve, false_weight: float) -> tuple[int, float]:
    """The threshold with the highest F0.5 if a false voxel counts ``false_weight`` times.

    Only ``STEPS`` are tried. Between finer ones the choice falls on where a few voxels of the crops
    at hand happen to lie, and does not carry over to others.

    Returns:
        its number in ``THRESHOLDS``, the highest in a tie, and that F0.5.
    """
    tp = curve.true[::-1].cumsum()[::-1][1:]
    fp = curve.false[::-1].cumsum()[::-1][1:]
    f05 = weighted_f05(tp, fp, int(curve.true.sum()), false_weight)[STEPS]
    highest = len(f05) - 1 - int(np.argmax(f05[::-1]))
    return int(STEPS[highest]), float(f05[highest])


def weighted_f05(
    tp: np.ndarray, fp: np.ndarray, labelled: np.ndarray | int, false_weight: float
) -> np.ndarray:
    """F0.5 if a false voxel counts ``false_weight`` times, from counts of the same shape."""
    b2 = BETA**2
    found = (1 + b2) * tp
    below = found + b2 * (labelled - tp) + false_weight * fp
    return found / np.maximum(below, 1e-12)
