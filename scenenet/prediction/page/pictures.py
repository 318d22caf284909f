"""The points around each tower, few enough for all of them to be in one page."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.progress import track
from scenenet.detection.survey_tower import SurveyTower
from scenenet.prediction.surroundings import survey_points

if TYPE_CHECKING:
    from scenenet.prediction.survey_prediction import SurveyPrediction

STEP_M = 0.01
"""m, step of the coordinates in a picture. A pixel is wider."""

OWN_POINTS, OTHER_POINTS = 1200, 1800
"""Most points of a tower and of its surroundings in a picture."""

FEWEST = 1 / 20
"""Smallest share of these numbers, however many towers a survey has."""

POINT_BYTES = 8
"""Bytes of a point in the page: three numbers of two bytes as base64."""

ALL_BYTES = 13_000_000
"""Bytes of all pictures of a page. With more towers each has fewer points."""

RADIUS_M = 15.0, 80.0
"""m, smallest and largest radius of a picture. Between them it is the height of the tower."""

FINER = 1.2
"""Ratio of successive cell sizes when points are thinned."""


@dataclass(frozen=True)
class TowerPicture:
    """The points around a tower.

    Attributes:
        tower: id of the tower.
        steps: (n, 3) int16, x, y and z in ``STEP_M`` from the foot of its axis, its own points
            first.
        own: number of its own points.
    """

    tower: int
    steps: np.ndarray
    own: int

    @classmethod
    def of(cls, tower: int, foot: np.ndarray, own: np.ndarray, others: np.ndarray) -> TowerPicture:
        """The picture of points (n, 3) m within ``RADIUS_M`` of a foot (3,) m."""
        offsets = np.concatenate([own, others]) - foot
        steps = np.rint(offsets / STEP_M).astype("<i2")
        return cls(tower, steps, len(own))

    def packed(self) -> str:
        """``steps`` as base64: little-endian, point by point."""
        return base64.b64encode(self.steps.tobytes()).decode("ascii")


def tower_pictures(prediction: SurveyPrediction) -> Iterator[TowerPicture]:
    """The picture of each tower of a prediction, in the order of its list."""
    points = survey_points(prediction.spool)
    share = share_of_points(len(prediction.towers))
    most_own, most_others = (max(1, int(share * n)) for n in (OWN_POINTS, OTHER_POINTS))
    for tower in track(_in_metres(prediction), "pictures of towers", total=len(prediction.towers)):
        foot = np.array([tower.x, tower.y, tower.base])
        radius = radius_of(tower.height)
        near = points(foot[:2], radius)
        above = near[:, 2] - foot[2]
        near = near[(above >= -radius) & (above <= tower.height + radius / 2)]
        own = prediction.owner(near) == tower.id
        yield TowerPicture.of(
            tower.id, foot, thinned(near[own], most_own), thinned(near[~own], most_others)
        )


def radius_of(height: float) -> float:
    """m, radius in plan of the picture of a tower of a height in m."""
    return float(np.clip(height, *RADIUS_M))


def share_of_points(n_towers: int) -> float:
    """Share of ``OWN_POINTS`` and ``OTHER_POINTS`` in each picture of a survey."""
    full = max(n_towers, 1) * (OWN_POINTS + OTHER_POINTS) * POINT_BYTES
    return max(FEWEST, min(1.0, ALL_BYTES / full))


def thinned(xyz: np.ndarray, most: int) -> np.ndarray:
    """At most ``most`` of the points (n, 3) m, one for each cell of a size that gives so many.

    Thin parts such as conductors keep their points, because a cell counts once, however many points
    are in it. Equal points in equal order give the same result.
    """
    if len(xyz) <= most:
        return xyz
    # Not the lowest point of each cell: trees would look like shelves.
    xyz = np.random.default_rng(0).permutation(xyz)
    offsets = xyz - xyz.min(axis=0)
    # Points lie on surfaces: about as many cells as points of the result cover the widest one.
    cell = max(STEP_M, float(np.sqrt(np.prod(np.sort(offsets.max(axis=0))[1:]) / most)) / 4)
    kept = _one_each(offsets, cell)
    while len(kept) > most:
        # The size is found with the points that are left: they are few.
        few = offsets[kept]
        while len(few) > most:
            cell *= FINER
            few = few[_one_each(few, cell)]
        kept = _one_each(offsets, cell)
    return xyz[kept]


def _one_each(offsets: np.ndarray, cell: float) -> np.ndarray:
    """Rows of the first of the points (n, 3) m in each cell, ascending; no offset is negative."""
    steps = np.floor(offsets / cell).astype(np.int64)
    code = (steps[:, 0] << 42) | (steps[:, 1] << 21) | steps[:, 2]
    return np.sort(np.unique(code, return_index=True)[1])


def _in_metres(prediction: SurveyPrediction) -> Iterable[SurveyTower]:
    planar, _, vertical = prediction.unit_sizes
    return (t.in_units((1 / planar, 1 / planar, 1 / vertical)) for t in prediction.towers)
