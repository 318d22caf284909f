"""Scores that are as good as the best one, as far as the crops can tell."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.metrics.threshold_choice import best_step
from scenenet.metrics.threshold_curve import ThresholdCurve
from scenenet.training.one_error import left_out, within_one_error


def crop(labelled: int, found: float, false: float) -> ThresholdCurve:
    """A crop in which a share of the labelled voxels is found, and a share as large of others."""
    tp, fp = round(labelled * found), round(labelled * false)
    probability = np.zeros(4 * labelled)
    probability[:tp], probability[labelled : labelled + fp] = 0.5, 0.5
    return ThresholdCurve.of(probability, np.arange(len(probability)) < labelled)


def test_a_score_without_a_crop_is_that_of_the_others():
    curves = [crop(100, 0.9, 0.1), crop(50, 0.4, 0.6), crop(200, 0.7, 0.0)]
    step, _ = best_step(sum(curves, ThresholdCurve.empty()), 1.0)
    without = left_out(curves, step, 1.0)
    for left, score in enumerate(without):
        others = [curve for n, curve in enumerate(curves) if n != left]
        counts = sum(others, ThresholdCurve.empty()).confusion(step)
        assert score == pytest.approx(counts.f05)


def test_a_lead_that_every_crop_shows_counts_and_one_that_few_show_does_not():
    rng = np.random.default_rng(0)
    best = 0.9 + rng.normal(0, 0.01, 40)
    steadily_worse, worse_by_one_crop = best - 0.005, best.copy()
    worse_by_one_crop[3] += 0.2  # without this crop it would be better
    without = np.array([best, steadily_worse, worse_by_one_crop])
    within = within_one_error(np.array([0.9, 0.895, 0.895]), without)
    assert within.tolist() == [True, False, True]


def test_one_crop_tells_no_error():
    assert within_one_error(np.array([0.8, 0.9]), np.zeros((2, 1))).tolist() == [False, True]
