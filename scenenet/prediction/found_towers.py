"""The towers of a survey: found in the predictions of all its tiles, kept as a JSON file."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from math import hypot, inf
from typing import Any

import numpy as np

from scenenet.detection.detected_voxels import DetectedSurvey, DetectedVoxels
from scenenet.detection.edge_distance import MAX_M, edge_distance
from scenenet.detection.find import find_towers
from scenenet.detection.measured_tower import MeasuredTower
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import SurveyTower
from scenenet.detection.tower_ids import tower_ids
from scenenet.prediction.surroundings import occupied_voxels, survey_points
from scenenet.prediction.survey_detections import SurveyDetections
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

    def with_others(
        self, others: FoundTowers, apart: float, unit_sizes: tuple[float, float, float]
    ) -> FoundTowers:
        """These towers, and those of ``others`` at other places, numbered together.

        Args:
            apart: m, distance from all of these that makes a place another one.
            unit_sizes: sizes in m of the units of x, y and z of the survey.
        """
        pairs = list(zip(self.towers, self.structures.numbered, strict=True))
        for tower, numbered in zip(others.towers, others.structures.numbered, strict=True):
            away = [hypot(tower.x - t.x, tower.y - t.y) * unit_sizes[0] for t, _ in pairs]
            if min(away, default=inf) > apart:
                pairs.append((tower, numbered))
        pairs.sort(key=lambda pair: (-pair[0].probability, pair[0].x, pair[0].y))
        places = np.array([(tower.x, tower.y) for tower, _ in pairs]).reshape(-1, 2)
        ids = tower_ids(places * unit_sizes[0])
        towers = (replace(tower, id=n) for (tower, _), n in zip(pairs, ids, strict=True))
        shapes = (shape for _, (_, shape) in pairs)
        return FoundTowers(tuple(towers), Structures(tuple(zip(ids, shapes, strict=True))))

    def without(self, ids: Collection[int]) -> FoundTowers:
        """These towers, less those with one of the ``ids``. The others keep their numbers."""
        numbered = (each for each in self.structures.numbered if each[0] not in ids)
        towers = (tower for tower in self.towers if tower.id not in ids)
        return FoundTowers(tuple(towers), Structures(tuple(numbered)))

    def to_json(self) -> dict[str, Any]:
        features = [tower.to_feature([tower.x, tower.y, tower.base]) for tower in self.towers]
        return {"towers": features, "structures": self.structures.to_json()}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> FoundTowers:
        """The towers that ``to_json`` gave."""
        towers = tuple(map(SurveyTower.from_feature, data["towers"]))
        return cls(towers, Structures.from_json(data["structures"]))


@dataclass(frozen=True)
class TowerSearch:
    """What towers of a survey are looked for in, and how.

    Attributes:
        spool: the voxels and points of all its files.
        predictions: of a model of towers, for all its tiles.
        unit_sizes: sizes in m of the units of its x, y and z.
        tau: of the model.
        settings: of the detection.
    """

    spool: TileSpool
    predictions: TilePredictions
    unit_sizes: tuple[float, float, float]
    tau: float
    settings: DetectionSettings


def find_in_survey(search: TowerSearch, progress: str | None = None) -> FoundTowers:
    """Find the towers of a survey.

    Args:
        progress: start of the labels of the progress on stderr; None shows no progress.
    """
    threshold = search.settings.threshold(search.tau)
    detected = SurveyDetections(search.spool, search.predictions, threshold)
    return _find(search, detected, detected.shares, progress)


def find_near(search: TowerSearch, place: np.ndarray, radius: float) -> FoundTowers:
    """Find the towers within a radius in m of a place (2,) m, whatever the model says of the voxels
    there. A tower whose voxels are all below tau needs twice the length of conductor. Conductors
    may pass it without a bend: in a dip they bend less than the few metres near an axis show, and
    the line decides by whole spans. All other rules hold.
    """
    spool, (low, high) = search.spool, (place - radius, place + radius)
    columns = spool.columns()
    around = spool.lattice.columns((low[0], high[0]), (low[1], high[1]))
    codes = [code for column in around for code in columns.get(column, ())]
    zyx, probability, shares = search.predictions.detected(0.0, codes)
    centres = spool.centres(zyx)
    inside = np.hypot(*(centres[:, :2] - place).T) <= radius
    # Axes are means weighted by probability, so none may be 0.
    at_least = np.maximum(probability[inside], np.finfo(np.float32).tiny)
    detected = DetectedVoxels(centres[inside], at_least, spool.voxel_size)
    return _find(search, detected, lambda *near: shares[inside][detected.within(*near)], bent=False)


def _find(
    search: TowerSearch,
    detected: DetectedSurvey,
    shares: Callable[[np.ndarray, float], np.ndarray],
    progress: str | None = None,
    *,
    bent: bool = True,
) -> FoundTowers:
    """The towers among detected voxels.

    Args:
        shares: gives the contributions (n, K) to the voxels within a radius in m of a place (2,) m
            relative to their offset.
    """
    spool = search.spool
    occupied, points = occupied_voxels(spool), survey_points(spool)
    found = find_towers(
        detected, occupied, points, search.tau, search.settings, progress, bent=bent
    )
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
        means = shares(tower.place, tower.reach).mean(axis=0).tolist()
        contributions = dict(zip(search.predictions.geneos, means, strict=True))
        entry = _entry(tower, number, n_own, distance, contributions)
        towers.append(entry.in_units(search.unit_sizes))
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
