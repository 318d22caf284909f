"""The shape of the labelled tower of a crop, measured in its points.

Voxels of a metre hardly show how wide a body is: one of 0.3 m occupies nearly the same voxels as
one of 0.1 m. Its points do. The labels only say where the tower stands; which points are its body
and its crossarms is decided as in ``scenenet.detection.structure``, because labels include ground,
branches and conductors.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from scenenet.dataset.crops import Crop
from scenenet.detection.candidates import SURROUNDINGS_M
from scenenet.detection.conductors import ConductorPoints, Span
from scenenet.detection.measure_structure import measure_structure
from scenenet.detection.structure import BodyTests, Structure
from scenenet.detection.surroundings import surroundings_in
from scenenet.pointcloud.cloud import PointCloud

BODY_SHARE = 0.25, 0.6
"""Shares of the height between which a body is measured: scrub is below, crossarms are above."""

CROSSARM = 0.4
"""Largest distance of a conductor from the axis as a share of the height: the longest arms of
portals."""

TESTS = BodyTests(height=4.0, upright=0.5, free=1 / 3)
"""What the body of a labelled tower has to be to be measured."""

LOWEST_M = 3.0
"""m above the ground from which conductors are looked for, half the height of the lowest tower."""

FEWEST, FEWEST_OF_ARMS = 10, 5
"""Smallest number of points of a body and of crossarms that are measured; an arm of a pole has few
points."""

ARM_END = 98.0
"""Percentile of the distances of the points of crossarms that is their reach: a branch or two may
lie beyond."""


@dataclass(frozen=True)
class TowerShape:
    """What the points of a tower say about its shape.

    Attributes:
        half_width: m, half the width of the body between ``BODY_SHARE`` of its height: the median
            over its points of the larger of their distances from the axis along and across the
            line. It is exact for a square lattice and 0.92 of the radius of a round pole.
        spread: m^2, median of |b^2 - half_width^2| over these points, where b is that larger
            distance: the thickness of the wall, and the tolerance sigma of a shell (thesis 4.4.1)
            that holds half of it.
        reach: m, of the crossarms from the axis; None where none was found.
        reach_spread: m^2, median of |d^2 - reach^2| over the points of the crossarms, where d is
            their distance from the axis; None where none was found.
    """

    half_width: float
    spread: float
    reach: float | None
    reach_spread: float | None

    def plain(self) -> dict[str, float | None]:
        """The numbers as they stand in a manifest."""
        return asdict(self)


def measure_shape(crop: Crop, cloud: PointCloud) -> TowerShape | None:
    """The shape of the tower in the middle of a crop; None where no body stands free."""
    centre = np.array([crop.x, crop.y])
    near = np.hypot(*(cloud.xyz[:, :2] - centre).T) <= SURROUNDINGS_M
    labelled = cloud.xyz[near & cloud.is_tower]
    if len(labelled) == 0:
        return None
    origin = np.array([*centre, labelled[:, 2].min()])
    points, height = cloud.xyz[near] - origin, float(np.ptp(labelled[:, 2]))
    axis, crossarm = np.zeros(2), max(3.0, CROSSARM * height)
    around = surroundings_in(points)
    conductors = ConductorPoints(around, LOWEST_M)

    def leaving(axis: np.ndarray, base: float, height: float, crossarm: float) -> list[Span]:
        return conductors.leaving(axis, base, height, crossarm, around)

    structure = measure_structure(points, leaving, axis, 0.0, height, crossarm, TESTS, amid=False)
    return None if structure is None else shape_of(structure, points)


def shape_of(structure: Structure, points: np.ndarray) -> TowerShape | None:
    """The shape of a tower whose points are among ``points`` (N, 3) m; None for too few."""
    s, t, h = structure.frame(points)
    low, high = (share * structure.height for share in BODY_SHARE)
    between = (h >= max(low, structure.foot)) & (h <= high)
    inside = between & structure.in_body(s, t, h)
    if inside.sum() < FEWEST:
        return None
    t_body = np.abs(np.abs(t[inside]) - structure.apart)
    beside = np.maximum(np.abs(s[inside]), t_body)
    half_width = float(np.median(beside))
    spread = float(np.median(np.abs(beside**2 - half_width**2)))
    at_arm = structure.in_arm(s, t, h) & ~structure.in_body(s, t, h)
    if at_arm.sum() < FEWEST_OF_ARMS:
        return TowerShape(half_width, spread, None, None)
    reach = float(np.percentile(np.abs(t[at_arm]), ARM_END))
    squared = s[at_arm] ** 2 + t[at_arm] ** 2
    reach_spread = float(np.median(np.abs(squared - reach**2)))
    return TowerShape(half_width, spread, reach, reach_spread)
