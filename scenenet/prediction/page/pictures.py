"""The points around each tower, few enough for all of them to be in one page."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.progress import track
from scenenet.detection.survey_tower import SurveyTower
from scenenet.prediction.page.budget import OTHER_POINTS, OWN_POINTS, PageBudget
from scenenet.prediction.page.thinning import STEP_M, thinned
from scenenet.prediction.surroundings import survey_points

if TYPE_CHECKING:
    from scenenet.prediction.survey_prediction import SurveyPrediction

RADIUS_M = 15.0, 80.0
"""m, smallest and largest radius of a picture. Between them it is the height of the tower."""


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


def tower_pictures(
    prediction: SurveyPrediction, towers: Sequence[SurveyTower], budget: PageBudget
) -> Iterator[TowerPicture]:
    """Pictures of towers of a prediction, in their order."""
    points = survey_points(prediction.spool)
    most_own, most_others = budget.points(OWN_POINTS), budget.points(OTHER_POINTS)
    known = _in_metres(towers, prediction.unit_sizes)
    for tower in track(known, "pictures of towers", total=len(towers)):
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


def _in_metres(
    towers: Iterable[SurveyTower], unit_sizes: tuple[float, float, float]
) -> Iterable[SurveyTower]:
    planar, _, vertical = unit_sizes
    return (t.in_units((1 / planar, 1 / planar, 1 / vertical)) for t in towers)
