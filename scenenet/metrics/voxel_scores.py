"""Scores of voxels (thesis 5.2.4.1), as docs/development/architecture.md defines them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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


def _ratio(part: float, whole: float) -> float:
    """0 where there is nothing to divide by, as a model that detects nothing has precision 0."""
    return part / whole if whole else 0.0
