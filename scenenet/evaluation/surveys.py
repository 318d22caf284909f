"""Scores of what ``scenenet predict`` finds in a labelled survey: points, towers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from scenenet.core.errors import in_file
from scenenet.core.progress import track
from scenenet.core.unchanged import unchanged
from scenenet.dataset.crops import Crop
from scenenet.dataset.tower_places import TowerPlaces
from scenenet.dataset.voxels import VoxelGrid
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.answers import Answer, places_of
from scenenet.evaluation.points import PointCounts
from scenenet.metrics.tower_matching import TowerMatch, match_towers
from scenenet.pointcloud import PointCloud, iter_chunks
from scenenet.pointcloud.targets import Target
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.used_models import ModelPaths


@dataclass(frozen=True)
class LabelledSurvey:
    """A survey or TS40K sample with its labels, and with its truth where it is known.

    Attributes:
        path: the file.
        codes: class scheme of its labels and of its truth.
        target: what is scored.
        towers: table of its labelled towers (``labelled_towers.COLUMNS``).
        crops: the crops that were cut from it; a TS40K sample is a single crop as it is.
        is_sample: whether it is a TS40K sample.
        truth: a file with the same points in the same order, with the true classes.
        true_towers: table of its true towers.
    """

    path: Path
    codes: str
    target: Target
    towers: pd.DataFrame
    crops: tuple[Crop, ...]
    is_sample: bool
    truth: Path | None = None
    true_towers: pd.DataFrame | None = None


@dataclass(frozen=True)
class SurveyScores:
    """What was counted in a whole survey; the counts of surveys add up.

    Attributes:
        points: of all points.
        by_crop: the answer in each crop, by its id: its points, and the towers whose axis is in
            it.
        towers: the towers found against the labelled ones.
        true_towers: the towers found against the true ones; None where the truth is not known.
    """

    points: PointCounts = field(default_factory=PointCounts)
    by_crop: Mapping[str, Answer] = field(default_factory=dict)
    towers: TowerMatch = field(default_factory=TowerMatch.none)
    true_towers: TowerMatch | None = None

    def __add__(self, other: SurveyScores) -> SurveyScores:
        matches = [m for m in (self.true_towers, other.true_towers) if m is not None]
        return SurveyScores(
            self.points + other.points,
            {**self.by_crop, **other.by_crop},
            self.towers + other.towers,
            sum(matches[1:], matches[0]) if matches else None,
        )


def score_survey(
    survey: LabelledSurvey,
    models: ModelPaths,
    detection: DetectionSettings,
    grids: Mapping[str, VoxelGrid],
) -> SurveyScores:
    """Predict a whole survey at the voxel size of the model, and score its towers and points. For
    another target than towers there are points alone.

    Memory is bounded by a chunk of points and a tile of voxels.

    Args:
        models: model file with tau, of the target of the survey. With models of other targets it
            is what they find together: with one of towers, points of conductors are wires too.
        grids: of the voxels of each crop, by its id.

    Raises:
        InputError: the survey, its truth or the model cannot be used.
    """
    counts, places = PointCounts(), TowerPlaces(survey.towers)
    target = survey.target
    crops = [_CropTally(crop, survey.is_sample, grids[crop.id], target) for crop in survey.crops]
    true_places = None if survey.true_towers is None else TowerPlaces(survey.true_towers)
    settings = PredictSettings()
    with predict_survey(survey.path, models, settings, detection) as prediction:
        files = (*prediction.states, *(() if survey.truth is None else (survey.truth,)))
        with unchanged(*files), in_file(survey.path):
            chunks = iter_chunks(survey.path, survey.codes, settings.chunk_points, survey.truth)
            for chunk in track(chunks, f"{survey.path.name}: points scored"):
                taken = prediction.taken(chunk.xyz, target.name)
                counts += PointCounts.of(chunk, taken, target)
                for crop in crops:
                    crop.add(chunk, taken)
                places.add(chunk)
                if true_places is not None and (true := chunk.with_truth) is not None:
                    true_places.add(true)
        found = places_of(prediction.towers if target.is_tower else ())
    return SurveyScores(
        counts,
        {tally.crop.id: tally.answer(found) for tally in crops},
        match_towers(found, places.places()),
        None if true_places is None else match_towers(found, true_places.places()),
    )


@dataclass
class _CropTally:
    """What the prediction of a survey says about one of its crops.

    Attributes:
        crop: the crop.
        is_sample: whether it is the whole TS40K sample.
        grid: of its voxels.
        target: what is scored.
        points: counts of its points so far.
        voxels: flat indices of the voxels with a point taken for the target so far, ascending.
    """

    crop: Crop
    is_sample: bool
    grid: VoxelGrid
    target: Target
    points: PointCounts = field(default_factory=PointCounts)
    voxels: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))

    def add(self, chunk: PointCloud, taken: np.ndarray) -> None:
        """Count the points of a chunk that lie in the crop; ``taken`` (N,) bool is of all."""
        inside = self._inside(chunk.xyz)
        self.points += PointCounts.of(chunk.select(inside), taken[inside], self.target)
        own = chunk.xyz[inside[taken[inside]]]
        self.voxels = np.union1d(self.voxels, self.grid.voxel_of(own))

    def answer(self, towers: np.ndarray) -> Answer:
        """The answer in the crop, with those of the ``towers`` (T, 4) of the survey in it."""
        return Answer(self.points, self.voxels, towers[self._inside(towers)])

    def _inside(self, places: np.ndarray) -> np.ndarray:
        """Rows of the places (N, 2 or more) m in the crop, as ``dataset.crops`` cuts it."""
        return np.arange(len(places)) if self.is_sample else self.crop.inside(places)
