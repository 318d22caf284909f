"""Counts of predicted against labelled voxels or points (thesis 5.2.4.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.metrics import score_columns
from scenenet.metrics.score_columns import SCORE_COLUMNS, ScoreFields


@dataclass(frozen=True)
class Confusion:
    """Counts of voxels or points, predicted against labelled.

    Counts of several samples add up, so that a score is taken over all their voxels together.
    """

    tp: int = 0
    fp: int = 0
    fn: int = 0
    tn: int = 0

    def __add__(self, other: Confusion) -> Confusion:
        return Confusion(
            self.tp + other.tp, self.fp + other.fp, self.fn + other.fn, self.tn + other.tn
        )

    @property
    def precision(self) -> float | None:
        return score_columns.precision(self)

    @property
    def recall(self) -> float | None:
        return score_columns.recall(self)

    @property
    def f05(self) -> float | None:
        """As ``scenenet.metrics.score_columns.f05``."""
        return score_columns.f05(self)

    @property
    def iou_tower(self) -> float | None:
        return score_columns.iou_tower(self)

    @property
    def iou_background(self) -> float | None:
        return score_columns.iou_background(self)

    @property
    def miou(self) -> float | None:
        """As ``scenenet.metrics.score_columns.miou``."""
        return score_columns.miou(self)

    @property
    def decisive(self) -> float:
        """F0.5 to choose by (thesis 5.2.7): 0 if it is not defined, because nothing is gained."""
        return self.f05 or 0.0

    def scores(self) -> dict[str, float | None]:
        """Every score of ``scenenet.metrics.score_columns`` by its name; None if not defined."""
        return {column.name: column.compute(self) for column in SCORE_COLUMNS}

    @classmethod
    def of(cls, predicted: np.ndarray, true: np.ndarray) -> Confusion:
        """Compare two masks (N,) bool."""
        tp, n_predicted, n_true = (
            int(np.count_nonzero(each)) for each in (predicted & true, predicted, true)
        )
        fp, fn = n_predicted - tp, n_true - tp
        return cls(tp, fp, fn, len(true) - tp - fp - fn)

    def without_predictions(self) -> Confusion:
        """The trivial baseline on the same voxels: a model that never predicts tower."""
        return Confusion(tp=0, fp=0, fn=self.tp + self.fn, tn=self.tn + self.fp)


def confusion(
    probability: np.ndarray, tower: np.ndarray, tau: float, n_voxels: int | None = None
) -> Confusion:
    """Compare probabilities with labels at ``tau``: a voxel is tower where probability >= tau > 0.

    Args:
        probability: (V,) probabilities. Voxels may be left out if they are neither predicted nor
            labelled tower.
        tower: (V,) bool, labels.
        n_voxels: number of voxels of the grid; V if None. Those beyond the V given ones count as
            correctly predicted background.
    """
    detected = probability >= tau
    tp = int(np.count_nonzero(detected & tower))
    fp = int(np.count_nonzero(detected)) - tp
    fn = int(np.count_nonzero(tower)) - tp
    total = probability.size if n_voxels is None else n_voxels
    return Confusion(tp, fp, fn, total - tp - fp - fn)


@dataclass(frozen=True)
class VoxelScores(ScoreFields):
    """Voxel scores at tau over all crops.

    Attributes:
        tau: the threshold.
        n_samples: number of crops.
    """

    tau: float
    n_samples: int

    @property
    def decisive(self) -> float:
        """As ``Confusion.decisive``."""
        return self.f05 or 0.0

    @classmethod
    def of(cls, counts: Confusion, tau: float, n_samples: int) -> VoxelScores:
        return cls(**counts.scores(), tau=tau, n_samples=n_samples)
