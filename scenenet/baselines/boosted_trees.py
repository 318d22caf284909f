"""Boosted trees on voxel features, a baseline.

The thesis only compares with a CNN (5.2.4.2). A strong model without interpretable parts shows
which scores the data allow, and how close eleven parameters come to them: scikit-learn's
``HistGradientBoostingClassifier`` on ``scenenet.baselines.voxel_features``, trained on the same
crops and scored on the same voxels. It never predicts a tower in an empty voxel.

The trees are copied to plain arrays and evaluated by compiled code, without scikit-learn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numba
import numpy as np
from pydantic import Field

from scenenet.baselines.quantile_bins import QuantileBins
from scenenet.baselines.voxel_features import voxel_features
from scenenet.core.errors import InputError
from scenenet.core.settings import Settings
from scenenet.dataset.voxels import VoxelSample
from scenenet.metrics.threshold_curve import ThresholdCurve


class BoostedTreesSettings(Settings):
    """Hyperparameters of the trees.

    About fifteen combinations were tried on real crops. These had the highest F0.5 on training
    crops that were left out, or the same F0.5 with a smaller spread over seeds. Fewer features per
    split, a quarter of the leaves or a lower tower weight are worse; other changes by up to a
    factor of two are not.
    """

    trees: int = Field(200, ge=1, description="number of trees, each correcting the ones before")
    learning_rate: float = Field(0.025, gt=0, le=1, description="share of each correction taken")
    leaves: int = Field(16, ge=2, description="leaves a tree has at most")
    leaf_voxels: int = Field(40, ge=1, description="training voxels that a leaf has at least")
    l2: float = Field(10.0, ge=0, description="shrinkage of the leaves' values")
    feature_share: float = Field(
        0.5, gt=0, le=1, description="share of the features that each split may choose from"
    )
    tower_weight: float = Field(
        0.3,
        gt=0,
        description="weight of all tower voxels together, the other occupied ones having 1",
    )


class Trees(NamedTuple):
    """Trees as arrays over their nodes, one tree after the other, parents before children.

    Attributes:
        root: (T,) int32, first node of each tree.
        feature: (N,) int32, feature that a node splits on; -1 in a leaf.
        threshold: (N,) float64; a row goes left if the feature is at most this.
        left, right: (N,) int32, child nodes; 0 in a leaf.
        value: (N,) float64, what a leaf adds to the log odds; 0 in other nodes.
    """

    root: np.ndarray
    feature: np.ndarray
    threshold: np.ndarray
    left: np.ndarray
    right: np.ndarray
    value: np.ndarray


@dataclass(frozen=True)
class BoostedTrees:
    """A trained model of boosted trees.

    Attributes:
        settings, seed: of the training.
        odds: log odds before the first tree.
        trees: the trees.
        tau: threshold; None before tuning.
        provenance: where it is from.
    """

    settings: BoostedTreesSettings
    seed: int
    odds: float
    trees: Trees
    tau: float | None
    provenance: dict[str, Any]

    def of_occupied(self, sample: VoxelSample) -> np.ndarray:
        """Probability that each occupied voxel is part of a tower, (M,) float32 in [0, 1]."""
        return self.of_features(voxel_features(sample))

    def of_features(self, features: np.ndarray) -> np.ndarray:
        """The same, from ``voxel_features`` (M, F)."""
        odds = _add_up(np.ascontiguousarray(features, np.float32), *self.trees) + self.odds
        return (1 / (1 + np.exp(-odds))).astype(np.float32)

    def probabilities(self, sample: VoxelSample) -> tuple[np.ndarray, np.ndarray]:
        """Probability (V,) float32 and labels (V,) bool of every voxel of the sample's grid, like
        ``scenenet.models.predictions.probabilities`` for the other models."""
        return sample.spread(self.of_occupied(sample))

    def n_parameters(self) -> int:
        """Number of trained numbers: feature and threshold of each split, value of each leaf."""
        leaves = int((self.trees.feature < 0).sum())
        return 2 * (len(self.trees.feature) - leaves) + leaves

    def threshold(self) -> float:
        """tau.

        Raises:
            InputError: the model has not been tuned.
        """
        if self.tau is None:
            raise InputError(
                "the boosted trees have no detection threshold", remedy="Tune it first"
            )
        return self.tau


def fit(
    training: Sequence[VoxelSample],
    settings: BoostedTreesSettings,
    seed: int,
    provenance: dict[str, Any] | None = None,
) -> BoostedTrees:
    """Train on the occupied voxels; the same arguments give the same trees.

    The seed determines the features that each split may choose from.

    Raises:
        InputError: the crops have no tower voxel, or no other one.
    """
    features = [voxel_features(sample) for sample in training]
    return fit_features(
        features, [sample.labelled for sample in training], settings, seed, provenance
    )


def threshold_curve(model: BoostedTrees, samples: Sequence[VoxelSample]) -> ThresholdCurve:
    """Scores at every threshold over all voxels of ``samples``, empty ones included."""
    total = ThresholdCurve.empty()
    for sample in samples:
        total += ThresholdCurve.of(*model.probabilities(sample))
    return total


def tune(model: BoostedTrees, curve: ThresholdCurve) -> BoostedTrees:
    """The model with the tau of the highest F0.5 of ``curve``."""
    return replace(model, tau=curve.best()[0])


def fit_and_tune(
    training: Sequence[VoxelSample],
    settings: BoostedTreesSettings,
    seed: int,
    provenance: dict[str, Any] | None = None,
) -> tuple[BoostedTrees, ThresholdCurve]:
    """Train on all crops and tune by leave-one-out, for data without validation crops.

    Trees memorise their training voxels, so tau must not be chosen on these: each crop is predicted
    by trees that were trained on the others.

    Returns:
        the tuned model, and the curve from which tau was chosen.

    Raises:
        InputError: there are fewer than two crops, or one holds all tower voxels.
    """
    if len(training) < 2:
        raise InputError(
            "tuning by leaving one crop out needs two crops or more",
            remedy="Add labelled crops, or tune on validation crops",
        )
    features = [voxel_features(sample) for sample in training]
    towers = [sample.labelled for sample in training]
    curve = ThresholdCurve.empty()
    for out, sample in enumerate(training):
        others = [i for i in range(len(training)) if i != out]
        model = fit_features(
            [features[i] for i in others], [towers[i] for i in others], settings, seed
        )
        curve += ThresholdCurve.of(*sample.spread(model.of_features(features[out])))
    model = fit_features(features, towers, settings, seed, provenance)
    return tune(model, curve), curve


def fit_features(
    features: Sequence[np.ndarray],
    towers: Sequence[np.ndarray],
    settings: BoostedTreesSettings,
    seed: int,
    provenance: dict[str, Any] | None = None,
) -> BoostedTrees:
    """``fit`` on crops whose features are known.

    Args:
        features: (M, F) of each crop, from ``voxel_features``.
        towers: (M,) bool of each crop, its occupied tower voxels.

    Raises:
        InputError: the crops have no tower voxel, or no other one.
    """
    tower = np.concatenate([*towers, np.empty(0, bool)])
    n_tower = int(tower.sum())
    if n_tower == 0 or n_tower == len(tower):
        what = "only tower voxels" if n_tower else "no tower voxel"
        raise InputError(
            f"the {len(towers)} training crops have {what}",
            remedy="Add labelled crops, and check their class scheme",
        )
    from sklearn.ensemble import HistGradientBoostingClassifier

    grown = HistGradientBoostingClassifier(
        max_iter=settings.trees,
        learning_rate=settings.learning_rate,
        max_leaf_nodes=settings.leaves,
        min_samples_leaf=settings.leaf_voxels,
        l2_regularization=settings.l2,
        max_features=settings.feature_share,
        early_stopping=False,  # it would validate on neighbours of training voxels
        random_state=seed,
    )
    each = settings.tower_weight * (len(tower) - n_tower) / n_tower
    weights = np.where(tower, each, 1.0)
    known = np.concatenate(features)
    bins = QuantileBins(known, weights)
    grown.fit(bins.numbers(known), tower, sample_weight=weights)
    odds = float(grown._baseline_prediction.item())
    return BoostedTrees(settings, seed, odds, _trees_of(grown, bins), None, dict(provenance or {}))


def _trees_of(grown: Any, bins: QuantileBins | None = None) -> Trees:
    """The trees of a classifier that was fitted to features, or to their ``bins``.

    scikit-learn has no public access to them; a test compares the probabilities with its own.
    """
    nodes = [predictor.nodes for (predictor,) in grown._predictors]
    root = np.cumsum([0, *(len(tree) for tree in nodes)])[:-1].astype(np.int32)
    every = np.concatenate(nodes)
    shift = np.repeat(root, [len(tree) for tree in nodes])
    leaf = every["is_leaf"].astype(bool)
    feature, threshold = every["feature_idx"], every["num_threshold"].astype(np.float64)
    if bins is not None:
        for split in np.flatnonzero(~leaf):
            threshold[split] = bins.threshold(feature[split], threshold[split])
    return Trees(
        root,
        np.where(leaf, -1, feature).astype(np.int32),
        np.where(leaf, 0.0, threshold),
        np.where(leaf, 0, every["left"] + shift).astype(np.int32),
        np.where(leaf, 0, every["right"] + shift).astype(np.int32),
        np.where(leaf, every["value"], 0.0),
    )


@numba.njit(cache=True)
def _add_up(features, root, feature, threshold, left, right, value):  # pragma: no cover - compiled
    """(M,) float64, for each row of ``features`` the sum of its leaves over all trees."""
    out = np.zeros(len(features))
    for i in range(len(features)):
        for tree in range(len(root)):
            node = root[tree]
            while feature[node] >= 0:
                goes_left = features[i, feature[node]] <= threshold[node]
                node = left[node] if goes_left else right[node]
            out[i] += value[node]
    return out
