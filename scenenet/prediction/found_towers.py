"""The towers of a survey: found in the predictions of all its tiles, kept as a JSON file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenenet.detection.edge_distance import MAX_M, edge_distance
from scenenet.detection.find import MeasuredTower, find_towers
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import SurveyTower
from scenenet.detection.tower_ids import tower_ids
from scenenet.prediction.surroundings import occupied_voxels, survey_points
from scenenet.prediction.work.structures import Owners, Structures
from scenenet.prediction.work.tile_predictions import TilePredictions
from scenenet.prediction.work.tiling import TileSpool


@dataclass(frozen=True)
class FoundTowers:
    """The towers of a survey, highest probability first.

    Attributes:
        towers: in the units of the survey.
        structures: their shapes, in the same order.
    """

    towers: tuple[SurveyTower, ...]
    structures: Structures

    @classmethod
    def none(cls) -> FoundTowers:
        """No tower, because none was looked for."""
        return cls((), Structures(()))

    def to_json(self) -> dict[str, Any]:
        features = [tower.to_feature([tower.x, tower.y, tower.base]) for tower in self.towers]
        return {"towers": features, "structures": self.structures.to_json()}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> FoundTowers:
        """The towers that ``to_json`` gave."""
        towers = tuple(map(SurveyTower.from_feature, data["towers"]))
        return cls(towers, Structures.from_json(data["structures"]))


def find_in_survey(
    spool: TileSpool,
    predictions: TilePredictions,
    unit_sizes: tuple[float, float, float],
    tau: float,
    settings: DetectionSettings,
    progress: str | None = None,
) -> FoundTowers:
    """Find the towers of a survey.

    Args:
        spool: the voxels and points of all its files.
        predictions: for all its tiles.
        unit_sizes: sizes in m of the units of its x, y and z.
        tau: of the model.
        progress: label of the progress on stderr; None shows no progress.
    """
    zyx, probability, shares = predictions.detected(spool, settings.threshold(tau))
    occupied, points = occupied_voxels(spool), survey_points(spool)
    centres, size = spool.centres(zyx), spool.voxel_size
    found = find_towers(centres, probability, occupied, points, size, tau, settings, progress)
    numbers = tower_ids(np.array([(tower.x, tower.y) for tower in found]).reshape(-1, 2))
    shapes = (tower.structure for tower in found)
    structures = Structures(tuple(zip(numbers, shapes, strict=True)))
    owners, towers = Owners(structures, spool.lattice), []
    for number, tower in zip(numbers, found, strict=True):
        place = np.array([tower.x, tower.y])
        near = points(place, tower.structure.reach)
        inside = near[tower.structure.contains(near)]
        n_own = int(np.count_nonzero(owners(inside) == number))
        distance = edge_distance(place, occupied(place, MAX_M * 1.5)[:, :2])
        means = shares[tower.voxels].mean(axis=0).tolist()
        contributions = dict(zip(predictions.geneos, means, strict=True))
        entry = _entry(tower, number, n_own, distance, contributions)
        towers.append(entry.in_units(unit_sizes))
    return FoundTowers(tuple(towers), structures)


def _entry(
    tower: MeasuredTower,
    number: int,
    points: int,
    distance: float,
    contributions: Mapping[str, float],
) -> SurveyTower:
    return SurveyTower(
        id=number,
        x=tower.x,
        y=tower.y,
        height=tower.height,
        base=tower.base,
        width=tower.width,
        conductor_directions=len(tower.spans),
        conductor_bearings=tuple(span.bearing for span in tower.spans),
        probability=tower.probability,
        points=points,
        edge_distance=distance,
        contributions=contributions,
    )
