"""Scores of voxels and of towers (thesis 5.2.4.1; docs/design.md, Definitions)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

THRESHOLDS = np.tanh(np.arange(1, 651) / 100)
"""The thresholds that are tried, (650,), ascending; without 0, where everything would be a tower.

They are evenly spaced in what the observer answers before tanh (thesis 4.3). An observer that sums
up dozens of voxels has most of its probabilities above 0.99, where evenly spaced thresholds could
not tell them apart; beyond the last one float32 cannot tell neighbours apart either.
"""

BETA = 0.5
"""Precision counts twice as much as recall (thesis 5.2.4.1)."""


@dataclass(frozen=True)
class Confusion:
    """Counts of voxels, predicted against true. Sums of them are scores over all samples."""

    tp: int = 0
    fp: int = 0
    fn: int = 0
    tn: int = 0

    def __add__(self, other: Confusion) -> Confusion:
        return Confusion(
            self.tp + other.tp, self.fp + other.fp, self.fn + other.fn, self.tn + other.tn
        )

    @property
    def precision(self) -> float:
        return _ratio(self.tp, self.tp + self.fp)

    @property
    def recall(self) -> float:
        return _ratio(self.tp, self.tp + self.fn)

    @property
    def f05(self) -> float:
        """F_beta = (1 + beta^2) P R / (beta^2 P + R), beta = 0.5."""
        b2 = BETA**2
        return _ratio((1 + b2) * self.tp, (1 + b2) * self.tp + b2 * self.fn + self.fp)

    @property
    def iou_tower(self) -> float:
        return _ratio(self.tp, self.tp + self.fp + self.fn)

    @property
    def iou_background(self) -> float:
        return _ratio(self.tn, self.tn + self.fp + self.fn)

    @property
    def miou(self) -> float:
        """Mean over {background, tower}: the thesis' "IoU". Predicting nothing scores about 0.5."""
        return (self.iou_tower + self.iou_background) / 2

    def scores(self) -> dict[str, float]:
        return {
            name: float(getattr(self, name))
            for name in ("precision", "recall", "f05", "iou_tower", "miou")
        }

    def without_predictions(self) -> Confusion:
        """The trivial baseline on the same voxels: a model that never says tower."""
        return Confusion(tp=0, fp=0, fn=self.tp + self.fn, tn=self.tn + self.fp)


def confusion(
    probability: np.ndarray, tower: np.ndarray, tau: float, n_voxels: int | None = None
) -> Confusion:
    """Compare probabilities with the truth at ``tau``: tower where probability >= tau > 0.

    Args:
        probability: (V,) probabilities; of any voxels as long as all predicted and all true ones
            are among them.
        tower: (V,) bool.
        n_voxels: number of voxels that count; V if None. The V given ones come first, the rest is
            taken for correctly predicted background.
    """
    detected = probability >= tau
    tp = int(np.count_nonzero(detected & tower))
    fp = int(np.count_nonzero(detected)) - tp
    fn = int(np.count_nonzero(tower)) - tp
    total = probability.size if n_voxels is None else n_voxels
    return Confusion(tp, fp, fn, total - tp - fp - fn)


@dataclass(frozen=True)
class ThresholdCurve:
    """Confusions at every one of ``THRESHOLDS``; curves of several samples add up.

    Attributes:
        true, false: (651,) counts of tower and of other voxels that reach i of the thresholds.
    """

    true: np.ndarray
    false: np.ndarray

    @classmethod
    def empty(cls) -> ThresholdCurve:
        """Of no voxels: where a sum begins."""
        nothing = np.zeros(len(THRESHOLDS) + 1, np.int64)
        return cls(nothing, nothing)

    @classmethod
    def of(cls, probability: np.ndarray, tower: np.ndarray) -> ThresholdCurve:
        """From probabilities (V,) and truth (V,) bool; all voxels of the grid must be given."""
        # Compared in the probabilities' own type, as ``confusion`` does: 0.3 counts for 0.3.
        taus = THRESHOLDS.astype(probability.dtype)
        # Most voxels are empty and have probability 0; they are counted and not sorted into bins.
        # What is not a number is no tower either.
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
        """At ``tau[step]``."""
        tp, fp = int(self.true[step + 1 :].sum()), int(self.false[step + 1 :].sum())
        return Confusion(tp, fp, int(self.true.sum()) - tp, int(self.false.sum()) - fp)

    def at(self, tau: float) -> Confusion:
        """At one of the thresholds.

        Raises:
            ValueError: ``tau`` is none of them.
        """
        (steps,) = np.nonzero(self.tau == tau)
        if len(steps) != 1:
            raise ValueError(f"{tau} is none of the {len(self.tau)} thresholds")
        return self.confusion(int(steps[0]))

    def precision_recall(self) -> tuple[np.ndarray, np.ndarray]:
        """Precision and recall (650,) at each tau; both 0 where nothing is detected."""
        tp = self.true[::-1].cumsum()[::-1][1:]
        fp = self.false[::-1].cumsum()[::-1][1:]
        detected = np.maximum(tp + fp, 1)
        return tp / detected, tp / max(1, int(self.true.sum()))

    def best(self) -> tuple[float, Confusion]:
        """tau with the highest F0.5, the highest such tau in a tie, and the counts there."""
        precision, recall = self.precision_recall()
        b2 = BETA**2
        below = b2 * precision + recall
        f05 = np.where(below > 0, (1 + b2) * precision * recall / np.where(below > 0, below, 1), 0)
        step = int(len(f05) - 1 - np.argmax(f05[::-1]))
        return float(self.tau[step]), self.confusion(step)

    def average_precision(self) -> float:
        """Area under the precision-recall curve (thesis Figure 5.7), as a step function."""
        precision, recall = self.precision_recall()
        gained = -np.diff(np.append(recall, 0.0))
        return float((precision * gained).sum())


@dataclass(frozen=True)
class TowerMatch:
    """Predicted towers against true ones.

    Attributes:
        errors: (hits,) m, planar distance of each predicted tower to the true one it hit.
        n_true, n_predicted: number of towers.
    """

    errors: np.ndarray
    n_true: int
    n_predicted: int

    def __add__(self, other: TowerMatch) -> TowerMatch:
        return TowerMatch(
            np.concatenate([self.errors, other.errors]),
            self.n_true + other.n_true,
            self.n_predicted + other.n_predicted,
        )

    def scores(self) -> dict[str, float | int | None]:
        hits = len(self.errors)
        return {
            "precision": _ratio(hits, self.n_predicted),
            "recall": _ratio(hits, self.n_true),
            "median_error_m": float(np.median(self.errors)) if hits else None,
            "n_true": self.n_true,
            "n_predicted": self.n_predicted,
        }


HIT_DISTANCE_M = 5.0
"""A predicted tower this near (xy) to a true one is a hit (docs/design.md)."""


def match_towers(
    predicted: np.ndarray, true: np.ndarray, distance: float = HIT_DISTANCE_M
) -> TowerMatch:
    """Pair predicted (P, 2) with true (T, 2) positions, nearest pairs first, each used once."""
    predicted = np.asarray(predicted, float).reshape(-1, 2)
    true = np.asarray(true, float).reshape(-1, 2)
    apart = np.linalg.norm(predicted[:, None] - true[None], axis=2)
    taken_predicted, taken_true, errors = set(), set(), []
    for flat in np.argsort(apart, axis=None, kind="stable"):
        i, j = (int(k) for k in np.unravel_index(flat, apart.shape))
        if apart[i, j] > distance:
            break
        if i in taken_predicted or j in taken_true:
            continue
        taken_predicted.add(i)
        taken_true.add(j)
        errors.append(apart[i, j])
    return TowerMatch(np.asarray(errors, float), len(true), len(predicted))


def _ratio(part: float, whole: float) -> float:
    """0 where there is nothing to divide by, as a model that detects nothing has precision 0."""
    return part / whole if whole else 0.0
