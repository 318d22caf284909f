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

from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve
from scenenet.metrics.voxel_scores import BETA
from scenenet.models.answers import Scene, curve_of
from scenenet.models.scenenet import SceneNet
from scenenet.training.cma_es import Score


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
    b2 = BETA**2
    found = (1 + b2) * tp
    below = found + b2 * (int(curve.true.sum()) - tp) + false_weight * fp
    f05 = (found / np.maximum(below, 1e-12))[STEPS]
    highest = len(f05) - 1 - int(np.argmax(f05[::-1]))
    return int(STEPS[highest]), float(f05[highest])


def scorer(model: SceneNet, scenes: Sequence[Scene]) -> Score:
    """The score of a set of numbers: the F0.5 of ``best_step`` at its own best tau."""
    assert model.metric is not None
    false_weight = model.metric.false_weight

    def score(numbers: np.ndarray) -> float:
        model.set_numbers(numbers)
        return best_step(curve_of(model, scenes), false_weight)[1]

    return score


def draws(model: SceneNet, n: int, rng: np.random.Generator) -> np.ndarray:
    """(n, P) numbers over the whole ranges; the mixing weights evenly over all there can be."""
    n_mixing = len(model.names) - 1
    share = rng.uniform(0.03, 0.97, (n, model.n_parameters() - n_mixing))
    shapes = np.log(share / (1 - share))
    weights = np.maximum(rng.dirichlet(np.ones(n_mixing + 1), n), 1e-3)
    return np.concatenate([shapes, np.log(weights[:, :-1] / weights[:, -1:])], axis=1)
