"""The numbers of a SCENE-Net in metres, found without a gradient (docs/method/accuracy.md).

Eleven numbers need no gradient, and the one of the thesis' loss is the reason for dead starts:
where the observer is negative, ReLU lets none through. Here whole sets of numbers are drawn, scored
on the training crops, and drawn again about the better ones: the covariance matrix adaptation of
Hansen (2016, arXiv:1604.00772). The search begins at the best of many draws over the whole ranges,
so it never begins where nothing is found as long as any of the draws finds something.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.predictions import PreparedCrop, curve_of
from scenenet.training.cma_es import Score


def scorer(model: MetricSceneNet, crops: Sequence[PreparedCrop]) -> Score:
    """Scores a set of numbers by the weighted F0.5 at its own best tau."""

    def score(numbers: np.ndarray) -> float:
        model.set_numbers(numbers)
        return model.best_step(curve_of(model, crops))[1]

    return score


def draws(model: MetricSceneNet, n: int, rng: np.random.Generator) -> np.ndarray:
    """(n, P) numbers over the whole ranges; the mixing weights evenly over all there can be."""
    n_mixing = len(model.names) - 1
    share = rng.uniform(0.03, 0.97, (n, model.n_parameters() - n_mixing))
    shapes = np.log(share / (1 - share))
    weights = np.maximum(rng.dirichlet(np.ones(n_mixing + 1), n), 1e-3)
    return np.concatenate([shapes, np.log(weights[:, :-1] / weights[:, -1:])], axis=1)
