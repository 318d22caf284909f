"""Points that a model takes for its target against those that are it, in the labels and in truth.

For towers these are the points to which ``scenenet predict`` gives a tower id; for another target,
the points in voxels at or above tau.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from scenenet.metrics.voxel_scores import Confusion
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.targets import TOWER, Target


@dataclass(frozen=True)
class PointCounts:
    """Counts of points; they add up.

    Attributes:
        labels: points taken for the target against points labelled with it.
        truth: points taken for the target against those that are it in truth; None where the truth
            is not known.
        labels_against_truth: points labelled with the target against those that are it in truth;
            None as ``truth``.
    """

    labels: Confusion = field(default_factory=Confusion)
    truth: Confusion | None = None
    labels_against_truth: Confusion | None = None

    @classmethod
    def of(cls, cloud: PointCloud, taken: np.ndarray, target: Target = TOWER) -> PointCounts:
        """Count points of which ``taken`` (N,) bool are taken for the target."""
        labelled, true = cloud.is_labelled(target), cloud.is_truly(target)
        labels = Confusion.of(taken, labelled)
        if true is None:
            return cls(labels)
        return cls(labels, Confusion.of(taken, true), Confusion.of(labelled, true))

    def __add__(self, other: PointCounts) -> PointCounts:
        return PointCounts(
            self.labels + other.labels,
            _sum(self.truth, other.truth),
            _sum(self.labels_against_truth, other.labels_against_truth),
        )


def _sum(one: Confusion | None, other: Confusion | None) -> Confusion | None:
    return one if other is None else other if one is None else one + other
