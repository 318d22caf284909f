"""Scores of predictions with known outcome."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from scenenet.metrics.score_columns import SCORES, ScoreFields, score_text
from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve, curve_columns
from scenenet.metrics.tower_matching import TowerMatch, match_towers
from scenenet.metrics.voxel_scores import Confusion, confusion

# 2 tp, 1 fp, 4 fn, 13 tn of 20 voxels
SMALL = Confusion(tp=2, fp=1, fn=4, tn=13)

steps = st.integers(1, 1000)
probabilities = st.one_of(
    st.floats(0, 1, width=32),
    steps.map(lambda step: step / 1000),  # at the thresholds themselves,
    steps.map(lambda step: float(np.nextafter(np.float32(step / 1000), np.float32(0)))),  # below
)
predictions = st.integers(1, 50).flatmap(
    lambda n: st.tuples(
        arrays(np.float32, n, elements=probabilities.map(lambda p: float(np.float32(p)))),
        arrays(bool, n),
    )
)


def test_scores_of_a_small_confusion_by_hand():
    assert SMALL.precision == pytest.approx(2 / 3)
    assert SMALL.recall == pytest.approx(2 / 6)
    # 1.25 P R / (0.25 P + R) = 1.25 * 2/9 / (1/6 + 1/3)
    assert SMALL.f05 == pytest.approx(1.25 * (2 / 9) / 0.5)
    assert SMALL.iou_tower == pytest.approx(2 / 7)
    assert SMALL.iou_background == pytest.approx(13 / 18)
    assert SMALL.miou == pytest.approx((2 / 7 + 13 / 18) / 2)


def test_every_score_has_a_field():
    """Files of scores have their columns from ``ScoreFields``, tables from ``SCORE_COLUMNS``."""
    assert tuple(field.name for field in fields(ScoreFields)) == SCORES


def test_precision_counts_more_than_recall():
    careful, eager = Confusion(tp=50, fp=10, fn=50), Confusion(tp=50, fp=50, fn=10)
    assert careful.f05 > eager.f05


def test_predicting_nothing_scores_half_in_the_thesis_iou_and_0_for_the_tower():
    trivial = Confusion(tp=30, fp=50, fn=70, tn=262_144 - 150).without_predictions()
    assert trivial == Confusion(tp=0, fp=0, fn=100, tn=262_144 - 100)
    assert trivial.miou == pytest.approx(0.5, abs=0.001)
    assert (trivial.iou_tower, trivial.precision, trivial.recall, trivial.f05) == (0, 0, 0, 0)


def test_a_perfect_prediction_scores_one():
    assert set(Confusion(tp=5, tn=95).scores().values()) == {1.0}


@pytest.mark.parametrize(
    ("counts", "undefined"),
    [
        (Confusion(tn=100), {"precision", "recall", "f05", "iou_tower", "miou"}),  # no tower
        (Confusion(fp=3, tn=97), {"recall"}),  # found where there is none
        (Confusion(fn=3, tn=97), set()),  # there and not found: 0, as the thesis counts
        (Confusion(tp=3), {"miou"}),  # nothing but towers
        (Confusion(), set(SCORES)),
    ],
)
def test_a_score_without_anything_to_measure_is_not_zero(counts, undefined):
    scores = counts.scores()
    assert {name for name, value in scores.items() if value is None} == undefined
    assert all(0 <= value <= 1 for value in scores.values() if value is not None)


def test_nothing_there_and_nothing_found_has_no_curve():
    curve = ThresholdCurve.of(np.array([0.9, 0.0]), np.array([False, False]))
    columns = curve_columns(curve)
    assert curve.average_precision() is None
    assert set(columns["recall"]) == {None}
    assert columns["precision"][0] == 0 and columns["precision"][-1] is None
    assert columns["f05"][0] == 0 and columns["f05"][-1] is None
    tau, counts = curve.best()
    assert (tau, counts.decisive) == (THRESHOLDS[-1], 0)


def test_a_score_is_written_in_a_sentence():
    assert [score_text(value) for value in (None, float("nan"), 0.0, 0.125)] == [
        "not defined", "not defined", "0.00", "0.12"
    ]  # fmt: skip


def test_counts_of_samples_add_up():
    assert SMALL + Confusion(1, 2, 3, 4) == Confusion(3, 3, 7, 17)


def test_a_voxel_is_a_tower_from_tau_on():
    probability = np.array([0.0, 0.29, 0.3, 0.31, 0.9], np.float32)
    tower = np.array([False, True, True, False, True])
    assert confusion(probability, tower, 0.3) == Confusion(tp=2, fp=1, fn=1, tn=1)


def test_voxels_that_are_not_given_count_as_true_negatives():
    probability, tower = np.array([0.9, 0.1]), np.array([True, True])
    assert confusion(probability, tower, 0.5, n_voxels=100) == Confusion(1, 0, 1, 98)


@given(predictions)
def test_the_curve_is_the_direct_confusion_at_each_tau(prediction):
    probability, tower = prediction
    curve = ThresholdCurve.of(probability, tower)
    precision, recall = curve.precision_recall()
    last = len(THRESHOLDS) - 1
    beside = np.searchsorted(THRESHOLDS, probability).clip(1, last)
    for step in {0, 1, 299, 300, last - 1, last, *beside.tolist(), *(beside - 1).tolist()}:
        direct = confusion(probability, tower, float(curve.tau[step]))
        assert curve.confusion(step) == direct
        for value, expected in ((precision[step], direct.precision), (recall[step], direct.recall)):
            assert np.isnan(value) if expected is None else value == expected


@given(predictions, predictions)
def test_curves_of_two_samples_add_up_to_the_curve_of_both(one, other):
    both = ThresholdCurve.of(*(np.concatenate(parts) for parts in zip(one, other, strict=True)))
    summed = ThresholdCurve.of(*one) + ThresholdCurve.of(*other)
    np.testing.assert_array_equal(summed.true, both.true)
    np.testing.assert_array_equal(summed.false, both.false)


@given(predictions)
def test_the_chosen_tau_has_the_best_f05_of_all(prediction):
    curve = ThresholdCurve.of(*prediction)
    tau, counts = curve.best()
    every = [curve.confusion(step).decisive for step in range(1000)]
    assert counts.decisive == pytest.approx(max(every))
    assert counts == confusion(*prediction, tau)


def test_tau_by_hand():
    probability = np.array([0.9, 0.8, 0.7, 0.6, 0.2])
    tower = np.array([True, True, False, True, False])
    curve = ThresholdCurve.of(probability, tower)
    # 0.8: P = 1, R = 2/3, F = 1.25 * 2/3 / (0.25 + 2/3) = 0.909; 0.6: P = 3/4, R = 1, F = 0.789
    tau, counts = curve.best()
    assert 0.79 < tau <= 0.8  # the highest of those above 0.7, which are all as good
    assert counts == Confusion(2, 0, 1, 2)
    assert counts.f05 == pytest.approx(0.9090909)


def test_without_any_gain_tau_is_the_highest():
    tau, counts = ThresholdCurve.of(np.array([0.9, 0.0]), np.array([False, True])).best()
    assert tau == THRESHOLDS[-1]
    assert counts == Confusion(0, 0, 1, 1)


def test_thresholds_differ_in_float32_and_none_is_zero_or_one():
    single = THRESHOLDS.astype(np.float32)
    assert (np.diff(single) > 0).all()
    assert single[0] > 0 and single[-1] < 1


def test_a_nan_probability_is_not_a_tower():
    nothing = np.full(3, np.nan, np.float32)
    tower = np.array([True, False, False])
    assert ThresholdCurve.of(nothing, tower).confusion(0) == confusion(nothing, tower, 0.001)


def test_average_precision_by_hand():
    probability = np.array([0.9, 0.8, 0.7, 0.6])
    tower = np.array([True, False, True, False])
    # recall 1/2 at precision 1, then 1 at precision 2/3
    curve = ThresholdCurve.of(probability, tower)
    assert curve.average_precision() == pytest.approx(0.5 * 1 + 0.5 * 2 / 3)
    assert ThresholdCurve.of(probability, probability > 0.65).average_precision() == 1.0


def test_a_tower_within_5_m_is_a_hit():
    match = match_towers(np.array([[3.0, 4.0], [105.1, 0.0]]), np.array([[0.0, 0], [100.0, 0]]))
    assert match.errors.tolist() == [5.0]
    assert match.scores() == {
        "precision": 0.5,
        "recall": 0.5,
        "median_error_m": 5.0,
        "median_height_error_m": None,
        "median_base_error_m": None,
        "n_true": 2,
        "n_predicted": 2,
    }


def test_a_true_tower_is_hit_once():
    match = match_towers(np.array([[1.0, 0], [-2.0, 0]]), np.array([[0.0, 0]]))
    assert match.errors.tolist() == [1.0]  # the nearer one; the other is a false tower
    assert match.scores()["precision"] == 0.5


def test_a_predicted_tower_hits_once():
    match = match_towers(np.array([[1.0, 0]]), np.array([[0.0, 0], [3.0, 0]]))
    assert match.errors.tolist() == [1.0]
    assert match.scores()["recall"] == 0.5


def test_nearest_pairs_come_first():
    match = match_towers(np.array([[0.0, 0], [4.0, 0]]), np.array([[3.0, 0], [8.0, 0]]))
    assert match.errors.tolist() == [1.0]


@pytest.mark.parametrize(
    ("n_predicted", "n_true", "precision", "recall"),
    [(0, 0, None, None), (0, 2, 0.0, 0.0), (2, 0, 0.0, None)],
)
def test_without_matches_there_is_no_position_error(n_predicted, n_true, precision, recall):
    scores = match_towers(np.zeros((n_predicted, 2)), np.zeros((n_true, 2))).scores()
    assert scores == {
        "precision": precision,
        "recall": recall,
        "median_error_m": None,
        "median_height_error_m": None,
        "median_base_error_m": None,
        "n_true": n_true,
        "n_predicted": n_predicted,
    }


def test_matches_of_samples_add_up():
    total = TowerMatch(np.array([1.0]), 1, 2) + TowerMatch(np.array([3.0, 4.0]), 3, 2)
    assert total.scores() == {
        "precision": 0.75, "recall": 0.75, "median_error_m": 3.0, "median_height_error_m": None,
        "median_base_error_m": None, "n_true": 4, "n_predicted": 4,
    }  # fmt: skip


def test_heights_and_bases_of_matched_towers_are_compared():
    """The second true tower has no known ground; the third predicted one is false."""
    true = np.array([[0.0, 0, 100, 20], [50, 0, np.nan, np.nan], [100, 0, 90, 30]])
    found = np.array([[101.0, 0, 92, 27], [0, 1, 99, 22], [51, 0, 70, 5], [300, 0, 0, 99]])
    match = match_towers(found, true)
    assert sorted(match.base_errors) == [1.0, 2.0]
    assert sorted(match.height_errors) == [2.0, 3.0]
    scores = match.scores()
    assert (scores["median_height_error_m"], scores["median_base_error_m"]) == (2.5, 1.5)
    total = (match + match_towers(np.array([[0.0, 0, 8, 9]]), np.array([[0.0, 0, 0, 0]]))).scores()
    assert (total["median_height_error_m"], total["median_base_error_m"]) == (3.0, 2.0)


def test_masks_of_points_are_counted():
    predicted, true = np.array([1, 1, 0, 0, 0], bool), np.array([1, 0, 1, 1, 0], bool)
    assert Confusion.of(predicted, true) == Confusion(tp=1, fp=1, fn=2, tn=1)
