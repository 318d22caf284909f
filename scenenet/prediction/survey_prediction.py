"""The prediction of a survey: what was read, predicted and found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.clearance.records import SurveyClearances
from scenenet.clearance.settings import ClearanceSettings
from scenenet.core.errors import warn
from scenenet.core.unchanged import FileState
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import SurveyTower
from scenenet.line.records import SurveyLine
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.prediction.file_status import SurveyFile, readable
from scenenet.prediction.found_line import WireSearch
from scenenet.prediction.found_towers import FoundTowers
from scenenet.prediction.point_dimensions import TOWER_CODE
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.used_models import UsedModel
from scenenet.prediction.work.point_predictions import (
    PointLookUp,
    PointPredictions,
    TargetTiles,
)
from scenenet.prediction.work.structures import Owners, Structures
from scenenet.prediction.work.survey_system import SurveySystem
from scenenet.prediction.work.survey_work import SurveyWork
from scenenet.prediction.work.tile_predictions import TilePredictions
from scenenet.prediction.work.tiling import TileSpool

if TYPE_CHECKING:
    import pyproj

    from scenenet.models.base import VoxelModel
    from scenenet.models.model_file import ModelCard


TALL_M = 45.0
"""Median height of towers, m, above which coordinates without a unit may be in feet: few lines have
taller towers, and those of medium voltage are 15 m, or 50 feet."""


@dataclass(frozen=True)
class FurtherModel:
    """A model of a prediction besides the first one, with what it predicts.

    Attributes:
        used: the model.
        spool: the voxels of the survey that it observes.
        tiles: the predictions on disk.
    """

    used: UsedModel
    spool: TileSpool
    tiles: TilePredictions

    @property
    def search(self) -> WireSearch:
        """What conductors are looked for in, where it is a model of wires."""
        return WireSearch(self.spool, self.tiles, self.used.card.threshold())


@dataclass(frozen=True)
class SurveyPrediction:
    """The predictions of a model for a survey, or of several models for different targets.

    Attributes:
        survey: its files, as they were named.
        files: its files, as they were read.
        model, card: the first model, that of towers if there is one, and what its file says.
        settings, detection: the settings of the prediction.
        system: the coordinates of the survey.
        spool: its voxels, those that the first model observes, and points, by tiles of voxels.
        towers: the towers found, highest probability first, in the units of the survey; none
            without a model of towers.
        structures: their shapes, m.
        tiles: the predictions of the first model on disk; they exist inside the ``with`` block of
            ``predict_survey``.
        started: ``time.perf_counter()`` at the start.
        code: class code for points taken for the target of the first model (``UsedModel``).
        further: the other models.
        line: its lines, m; None if they were not looked for: that needs a model of towers and one
            of wires.
        clearance: settings of ``clearances``; None for the defaults.
        clearances: what is near the lines, m; None if they were not looked for.
        scheme: of the class codes that ``spool`` has of its points; None if it has none.
    """

    survey: SurveyFiles
    files: tuple[SurveyFile, ...]
    model: VoxelModel
    card: ModelCard
    settings: PredictSettings
    detection: DetectionSettings
    system: SurveySystem
    spool: TileSpool
    towers: tuple[SurveyTower, ...]
    structures: Structures
    tiles: TilePredictions
    started: float
    code: int | None = TOWER_CODE
    further: tuple[FurtherModel, ...] = ()
    line: SurveyLine | None = None
    clearance: ClearanceSettings | None = None
    clearances: SurveyClearances | None = None
    scheme: ClassScheme | None = None

    @classmethod
    def of(
        cls,
        work: SurveyWork,
        tiles: TilePredictions,
        found: FoundTowers,
        *,
        model: VoxelModel,
        card: ModelCard,
        settings: PredictSettings,
        detection: DetectionSettings,
        started: float,
        code: int | None = TOWER_CODE,
        further: Sequence[FurtherModel] = (),
        line: SurveyLine | None = None,
        clearance: ClearanceSettings | None = None,
        clearances: SurveyClearances | None = None,
        scheme: ClassScheme | None = None,
    ) -> SurveyPrediction:
        """What was read, predicted and found."""
        return cls(
            survey=work.survey,
            files=work.files,
            model=model,
            card=card,
            settings=settings,
            detection=detection,
            system=work.system,
            spool=work.spool,
            towers=found.towers,
            structures=found.structures,
            tiles=tiles,
            started=started,
            code=code,
            further=tuple(further),
            line=line,
            clearance=clearance,
            clearances=clearances,
            scheme=scheme,
        )

    @property
    def crs(self) -> pyproj.CRS | None:
        """CRS of the survey; None where its files name none."""
        return self.system.crs

    @property
    def unit_sizes(self) -> tuple[float, float, float]:
        """Sizes in m of the units of its x, y and z."""
        return self.system.unit_sizes

    @property
    def unit_names(self) -> tuple[str, str, str]:
        """Names of the units of its x, y and z."""
        return self.system.unit_names

    @property
    def n_tiles(self) -> int:
        """Tiles of voxels that hold a point."""
        return len(self.spool)

    @property
    def voxel_size(self) -> float:
        """m."""
        return self.spool.voxel_size

    @property
    def n_points(self) -> int:
        """Points of the survey."""
        return sum(file.n_points for file in self.files)

    @property
    def states(self) -> tuple[FileState, ...]:
        """The states of the files that were read."""
        return tuple(state for _, state in readable(self.files))

    @property
    def notes(self) -> tuple[str, ...]:
        """What looks wrong about the survey as a whole, as sentences."""
        heights = [tower.height for tower in self.towers]
        if self.crs is not None or not heights or np.median(heights) <= TALL_M:
            return self.survey.notes
        return (
            *self.survey.notes,
            f"the towers are {np.median(heights):.0f} m high in the median, and no coordinate "
            "system names the unit. If the coordinates are in feet, name the system with --crs",
        )

    def warn(self) -> None:
        """Print what looks wrong about the files; what is wrong with several of them, once."""
        warn(self.survey.given, self.notes)
        found: dict[str, list[Path]] = {}
        for file in self.files:
            for text in file.warnings:
                found.setdefault(text, []).append(file.path)
        for text, paths in found.items():
            others = f" (and {len(paths) - 1} more files)" if len(paths) > 1 else ""
            warn(f"{paths[0]}{others}", [text])

    @property
    def geneos(self) -> tuple[str, ...]:
        """Names of the GENEOs that the shares belong to; empty for a model without GENEOs."""
        return self.tiles.geneos

    @cached_property
    def points(self) -> PointLookUp:
        """Says what was predicted for a point of the survey."""
        models = [_target_tiles(self.tiles, self.spool, self.card, self.code)]
        models += [
            _target_tiles(each.tiles, each.spool, each.used.card, each.used.code)
            for each in self.further
        ]
        return PointLookUp(models, self.structures, self.unit_sizes, self.line)

    @property
    def finds_towers(self) -> bool:
        """Whether towers were looked for."""
        return self.card.finds.is_tower

    @property
    def target_names(self) -> tuple[str, ...]:
        """Names of what was looked for, that of the first model first."""
        return (self.card.finds.name, *(each.used.target.name for each in self.further))

    @cached_property
    def _owners(self) -> Owners:
        return Owners(self.structures, self.spool.lattice)

    def owner(self, xyz: np.ndarray) -> np.ndarray:
        """(n,) uint32, id of the tower whose shape has each of the points (n, 3) m, 0 for none."""
        return self._owners(xyz)

    def taken(self, xyz: np.ndarray, target: str) -> np.ndarray:
        """(n,) bool, which points (n, 3) of the survey, in its units, are taken for the target with
        a name, one of ``target_names`` (``PointLookUp.taken``)."""
        return self.points.taken(self.look_up(xyz), self.target_names.index(target))

    def look_up(self, xyz: np.ndarray) -> PointPredictions:
        """Probabilities, tower id and shares of points (n, 3) of the survey, in its units."""
        return self.points(xyz)


def _target_tiles(
    tiles: TilePredictions, spool: TileSpool, card: ModelCard, code: int | None
) -> TargetTiles:
    return TargetTiles(tiles, spool.lattice, card.finds, card.threshold(), code)
