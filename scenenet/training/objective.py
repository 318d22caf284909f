"""What a search maximises: the score of a set of numbers of a SCENE-Net in metres, and its starts.

The gradient of the thesis' loss is zero where the observer is negative (ReLU), which is why some
models start dead. Eleven numbers can be found without a gradient: sets of numbers are drawn, scored
on the training crops, and drawn again around the better ones (docs/method/decisions.md). The search
starts at the best of many draws over the whole ranges. It therefore starts dead only if every draw
does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenenet.models.known_answers import KnownAnswers
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.predictions import PreparedCrop, curve_of
from scenenet.training.evolution import Score
from scenenet.training.measured_numbers import FreeNumbers

BEST_SHARE = 0.2
"""Share of the draws over the whole range that further ones are drawn around."""
LEAST_BEST = 4
"""Fewest of them: fewer say little about the spread."""


def scorer(free: FreeNumbers, crops: Sequence[PreparedCrop]) -> Score:
    """A function from a set of free numbers (F,) to the weighted F0.5 at its own best tau."""

    known = KnownAnswers()

    def score(numbers: np.ndarray) -> float:
        free.set(numbers)
        return free.model.best_step(curve_of(free.model, crops, known))[1]

    return score


def draws(model: MetricSceneNet, n: int, rng: np.random.Generator) -> np.ndarray:
    """(n, P) sets of numbers over the whole ranges; mixing weights uniform over all mixtures."""
    drawn = []
    for _, stage in model.stages():
        share = rng.uniform(0.03, 0.97, (n, len(stage.shape_list())))
        weights = np.maximum(rng.dirichlet(np.ones(len(stage.names)), n), 1e-3)
        drawn += [np.log(share / (1 - share)), np.log(weights[:, :-1] / weights[:, -1:])]
    return np.concatenate(drawn, axis=1)


def near_the_best(
    drawn: np.ndarray, scores: Sequence[float], n: int, rng: np.random.Generator
) -> np.ndarray:
    """(n, F) sets of free numbers around the best ``BEST_SHARE`` of those that were ``drawn``.

    They are normal, with the mean and the covariance of the best ones (the cross-entropy method:
    Rubinstein, "The Cross-Entropy Method for Combinatorial and Continuous Optimization", 1999).

    Args:
        drawn: (D, F) sets of free numbers.
        scores: of each of them.
    """
    kept = min(len(drawn), max(LEAST_BEST, round(BEST_SHARE * len(drawn))))
    best = drawn[np.argsort(scores, kind="stable")[-kept:]]
    spread = (
        np.atleast_2d(np.cov(best, rowvar=False)) if kept > 1 else np.zeros((best.shape[1],) * 2)
    )
    return rng.multivariate_normal(best.mean(axis=0), spread, n, method="eigh")
