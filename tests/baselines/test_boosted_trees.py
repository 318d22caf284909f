"""Boosted trees: the trees and the threshold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenenet.baselines import boosted_trees
from scenenet.baselines.boosted_trees import (
    BoostedTreesSettings,
    fit,
    fit_and_tune,
    threshold_curve,
    tune,
)
from scenenet.baselines.voxel_features import FEATURES, voxel_features
from scenenet.core.errors import InputError
from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.metrics.threshold_curve import ThresholdCurve
from scenenet.metrics.voxel_scores import Confusion, confusion

FEW = BoostedTreesSettings(trees=20)


@pytest.fixture(scope="module")
def crops(scene):
    """Poles next to trees, in crops about as wide as the trees are tall."""
    trees = [(5, 6), (24, 7), (8, 23), (22, 22)]
    clouds = [scene(((13.5 + i, 15.5),), tree=trees[i], seed=i) for i in range(4)]
    return [voxelise(c, VoxelGrid.metric(c.xyz, 1.0), f"crop-{i}") for i, c in enumerate(clouds)]


@pytest.fixture(scope="module")
def trained(crops):
    return fit_and_tune(crops[:3], FEW, 0, {"why": "test"})


def test_a_pole_in_an_unseen_crop_is_found(trained, crops):
    model, _ = trained
    probability, truth = model.probabilities(crops[3])
    assert confusion(probability, truth, model.threshold()).f05 > 0.9


def test_the_trees_give_the_probabilities_of_scikit_learn(crops):
    from sklearn.ensemble import HistGradientBoostingClassifier

    rng = np.random.default_rng(0)
    features = rng.normal(size=(3000, len(FEATURES))).astype(np.float32)
    features[::7, 3] = 0  # ties
    tower = features[:, 0] + features[:, 1] * features[:, 3] + rng.normal(size=3000) > 1
    grown = HistGradientBoostingClassifier(
        max_iter=30, max_leaf_nodes=9, max_features=0.4, early_stopping=False, random_state=1
    ).fit(features[:2000], tower[:2000])
    odds = float(grown._baseline_prediction.item())
    trees = boosted_trees._trees_of(grown)
    model = boosted_trees.BoostedTrees(BoostedTreesSettings(), 1, odds, trees, None, {})
    expected = grown.predict_proba(features)[:, 1]
    np.testing.assert_allclose(model.of_features(features), expected, rtol=1e-5)


def test_empty_voxels_are_never_tower(trained, crops):
    model, _ = trained
    probability, truth = model.probabilities(crops[3])
    assert probability.shape == truth.shape == (crops[3].grid.n_voxels,)
    assert probability.dtype == np.float32
    empty = np.delete(probability, crops[3].index)
    assert not empty.any()
    np.testing.assert_array_equal(probability[crops[3].index], model.of_occupied(crops[3]))
    assert set(np.flatnonzero(truth)) == set(crops[3].labelled_index())


def test_the_seed_determines_the_trees(crops):
    one, same, other = (fit(crops[:2], FEW, seed) for seed in (3, 3, 4))
    for name in one.trees._fields:
        np.testing.assert_array_equal(getattr(one.trees, name), getattr(same.trees, name))
    assert not np.array_equal(one.of_occupied(crops[3]), other.of_occupied(crops[3]))


def test_tau_is_where_f05_is_highest_on_validation(crops):
    grown = fit(crops[:3], FEW, 0)
    curve = threshold_curve(grown, crops[3:])
    model = tune(grown, curve)
    probability, truth = model.probabilities(crops[3])
    assert confusion(probability, truth, model.threshold()).f05 == curve.best()[1].f05


def test_tau_without_validation_is_chosen_by_leave_one_out(trained, crops):
    model, curve = trained
    expected = ThresholdCurve.empty()
    for out in range(3):
        others = [crops[i] for i in range(3) if i != out]
        expected += threshold_curve(fit(others, FEW, 0), [crops[out]])
    np.testing.assert_array_equal(curve.true, expected.true)
    np.testing.assert_array_equal(curve.false, expected.false)
    assert model.tau == curve.best()[0]
    whole = fit(crops[:3], FEW, 0)
    np.testing.assert_array_equal(model.of_occupied(crops[3]), whole.of_occupied(crops[3]))


def test_leave_one_out_refuses_a_single_crop(crops):
    with pytest.raises(InputError, match="two crops or more"):
        fit_and_tune(crops[:1], FEW, 0)


def test_a_tower_weight_is_the_weight_of_all_towers_together(crops):
    light, heavy = (
        fit(crops[:3], BoostedTreesSettings(trees=1, tower_weight=w), 0) for w in (0.1, 10.0)
    )
    assert light.odds == pytest.approx(np.log(0.1))
    assert heavy.odds == pytest.approx(np.log(10.0))


def test_training_crops_without_a_tower_are_refused(crops):
    bare = [replace(crop, labelled=np.zeros(len(crop.index), bool)) for crop in crops]
    with pytest.raises(InputError, match=r"the 4 training crops have no tower voxel"):
        fit(bare, FEW, 0)
    full = [replace(crop, labelled=np.ones(len(crop.index), bool)) for crop in crops]
    with pytest.raises(InputError, match="have only tower voxels"):
        fit(full, FEW, 0)
    with pytest.raises(InputError, match="the 0 training crops have no tower voxel"):
        fit([], FEW, 0)


def test_an_untuned_baseline_has_no_threshold(crops):
    with pytest.raises(InputError, match="no detection threshold"):
        fit(crops[:2], FEW, 0).threshold()


def test_the_parameters_are_those_of_splits_and_leaves(trained):
    model, _ = trained
    leaves = int((model.trees.feature < 0).sum())
    splits = leaves - len(model.trees.root)  # a binary tree has one more leaf than splits
    assert model.n_parameters() == 2 * splits + leaves > 0


FOLDS = (("sample_575", "sample_578"), ("sample_584", "sample_588"), ("sample_591", "sample_593"))
"""Leave-two-out over the six real crops, in the order of their names."""


def test_it_beats_simple_features_on_real_crops(real_samples):
    """For comparison, 22 simple features gave P 0.86, R 0.245, F0.5 0.573 on other crops."""
    total = Confusion()
    for test in FOLDS:
        training = [s for name, s in real_samples.items() if name not in test]
        model, _ = fit_and_tune(training, BoostedTreesSettings(), 0)
        for name in test:
            total += confusion(*model.probabilities(real_samples[name]), model.threshold())
    assert total.precision > 0.8
    assert total.f05 > 0.65


def test_probabilities_follow_from_the_features(trained, crops):
    model, _ = trained
    features = voxel_features(crops[3])
    np.testing.assert_array_equal(model.of_features(features), model.of_occupied(crops[3]))
    assert model.of_features(features[:0]).shape == (0,)
