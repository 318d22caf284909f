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
