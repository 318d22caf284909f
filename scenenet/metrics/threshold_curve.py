"""Counts and scores at every detection threshold tau (thesis 5.2.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.metrics.score_columns import BETA
from scenenet.metrics.voxel_scores import Confusion

THRESHOLDS = np.tanh(np.arange(1, 651) / 100)
"""Candidate thresholds, (650,), ascending; without 0, where every voxel would be a tower.

They are evenly spaced in the output of the observer before tanh (thesis 4.3). An observer that sums
dozens of voxels has most of its probabilities above 0.99, where evenly spaced thresholds could not
separate them; beyond the last threshold, neighbours are equal in float32.
"""


@dataclass(frozen=True)
class ThresholdCurve:
    """Counts of voxels at every one of ``THRESHOLDS``; curves of several samples add up.

    Attributes:
        true, false: (651,) numbers of voxels labelled tower, and of other voxels, whose probability
            reaches exactly i of the thresholds.
    """

    true: np.ndarray
    false: np.ndarray

    @classmethod
    def empty(cls) -> ThresholdCurve:
        """The curve of no voxels, to start a sum with."""
        nothing = np.zeros(len(THRESHOLDS) + 1, np.int64)
        return cls(nothing, nothing)

    @classmethod
    def of(cls, probability: np.ndarray, tower: np.ndarray) -> ThresholdCurve:
        """The curve of probabilities (V,) and labels (V,) bool of all V voxels of a grid."""
        # Compared in the type of the probabilities, as in ``confusion``: 0.3 reaches 0.3.
        taus = THRESHOLDS.astype(probability.dtype)
        # Most voxels are empty and have probability 0: they are counted without a search. NaN
        # counts as no tower, too.
        some = np.flatnonzero(probability > 0)
        bins, truth = np.searchsorted(taus, probability[some], side="right"), tower[some]
        n = len(THRESHOLDS) + 1
        true, false = np.bincount(bins[truth], minlength=n), np.bincount(bins[~truth], minlength=n)
        n_tower = int(np.count_nonzero(tower))
        true[0] += n_tower - int(true.sum())
        false[0] += probability.size - n_tower - int(false.sum())
        return cls(true, false)

    def __add__(self, other: ThresholdCurve) -> ThresholdCurve:
        return ThresholdCurve(self.true + other.true, self.false + other.false)

    @property
    def tau(self) -> np.ndarray:
        """The thresholds, (650,), ascending."""
        return THRESHOLDS

    def confusion(self, step: int) -> Confusion:
        """The counts at ``tau[step]``."""
        tp, fp = int(self.true[step + 1 :].sum()), int(self.false[step + 1 :].sum())
        return Confusion(tp, fp, int(self.true.sum()) - tp, int(self.false.sum()) - fp)

    def at(self, tau: float) -> Confusion:
        """The counts at one of the thresholds.

        Raises:
            ValueError: ``tau`` is not one of them.
        """
        (steps,) = np.nonzero(self.tau == tau)
        if len(steps) != 1:
            raise ValueError(f"{tau} is not one of the {len(self.tau)} thresholds")
        return self.confusion(int(steps[0]))

    def precision_recall(self) -> tuple[np.ndarray, np.ndarray]:
        """Precision and recall (650,) at each tau, NaN where they are not defined
        (``scenenet.metrics.score_columns``)."""
        tp = self.true[::-1].cumsum()[::-1][1:]
        fp = self.false[::-1].cumsum()[::-1][1:]
        labelled = int(self.true.sum())
        precision = tp / np.maximum(tp + fp, 1)
        if not labelled:
            return np.where(tp + fp > 0, precision, np.nan), np.full(len(tp), np.nan)
        return precision, tp / labelled

    def best(self) -> tuple[float, Confusion]:
        """tau with the highest F0.5 (the highest such tau in a tie), and the counts at it."""
        precision, recall = self.precision_recall()
        b2 = BETA**2
        below = b2 * precision + recall
        f05 = np.where(below > 0, (1 + b2) * precision * recall / np.where(below > 0, below, 1), 0)
        step = int(len(f05) - 1 - np.argmax(f05[::-1]))
        return float(self.tau[step]), self.confusion(step)

    def average_precision(self) -> float | None:
        """Area under the precision-recall curve (thesis Figure 5.7), as a step function; None if
        nothing is labelled tower."""
        if not self.true.any():
            return None
        precision, recall = self.precision_recall()
        gained = -np.diff(np.append(recall, 0.0))
        return float((precision * gained).sum())


def curve_columns(curve: ThresholdCurve) -> dict[str, list[float | None]]:
    """Precision, recall and F0.5 at every tau, as plain lists; None where they are not defined."""
    counts = [curve.confusion(step) for step in range(len(curve.tau))]
    return {
        "tau": curve.tau.tolist(),
        "precision": [at_tau.precision for at_tau in counts],
        "recall": [at_tau.recall for at_tau in counts],
        "f05": [at_tau.f05 for at_tau in counts],
    }
