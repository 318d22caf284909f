"""Which sets of numbers score no worse than the best one, as far as the crops can tell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenenet.metrics.threshold_choice import weighted_f05
from scenenet.metrics.threshold_curve import ThresholdCurve


def left_out(curves: Sequence[ThresholdCurve], step: int, false_weight: float) -> np.ndarray:
    """The weighted F0.5 at a threshold without each of the crops in turn, (C,).

    Args:
        curves: of each of the C crops.
        step: number of the threshold in ``scenenet.metrics.threshold_curve.THRESHOLDS``.
        false_weight: how much a false voxel counts.
    """
    counts = np.array(
        [(c.true[step + 1 :].sum(), c.false[step + 1 :].sum(), c.true.sum()) for c in curves]
    )
    tp, fp, labelled = (counts.sum(axis=0) - counts).T
    return weighted_f05(tp, fp, labelled, false_weight)


def within_one_error(scores: np.ndarray, without: np.ndarray) -> np.ndarray:
    """Which scores lie within one standard error of the highest one, (D,) bool.

    The error is that of the difference between the two on the same crops (jackknife). Whatever lies
    within it may be the better one on other crops: the rule of one standard error (Breiman and
    others, "Classification and Regression Trees", 1984, 3.4.3).

    Args:
        scores: of D sets of numbers on all crops, (D,).
        without: ``left_out`` of each, (D, C).
    """
    best, crops = int(np.argmax(scores)), without.shape[1]
    lead = without[best] - without
    spread = ((lead - lead.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
    error = np.sqrt((crops - 1) / crops * spread)
    within: np.ndarray = scores[best] - scores <= error
    return within
