"""Points with a tower id against the points that are tower, in the labels and in truth.

The tower ids are those that ``scenenet predict`` writes for the same points.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from scenenet.metrics.voxel_scores import Confusion
from scenenet.pointcloud.cloud import PointCloud


@dataclass(frozen=True)
class PointCounts:
    """Counts of points; they add up.

    Attributes:
        labels: points with a tower id against points labelled tower.
        truth: points with a tower id against true tower points; None where the truth is not known.
        labels_against_truth: points labelled tower against true tower points; None as ``truth``.
    """

    labels: Confusion = field(default_factory=Confusion)
    truth: Confusion | None = None
    labels_against_truth: Confusion | None = None

    @classmethod
    def of(cls, cloud: PointCloud, in_tower: np.ndarray) -> PointCounts:
        """Count points of which ``in_tower`` (N,) bool have a tower id."""
        labelled, true = cloud.is_tower, cloud.is_true_tower
        labels = Confusion.of(in_tower, labelled)
        if true is None:
            return cls(labels)
        return cls(labels, Confusion.of(in_tower, true), Confusion.of(labelled, true))

    def __add__(self, other: PointCounts) -> PointCounts:
        return PointCounts(
            self.labels + other.labels,
            _sum(self.truth, other.truth),
            _sum(self.labels_against_truth, other.labels_against_truth),
        )


def _sum(one: Confusion | None, other: Confusion | None) -> Confusion | None:
    return one if other is None else other if one is None else one + other
