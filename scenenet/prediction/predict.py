"""Prediction of a whole survey: files are read, then predicted, then searched for towers.

Each of these stages is a function of files, so that the workflow can run it as a job of its own:
``read_file``, ``predict_file`` and ``find_in_survey``; ``write_points`` follows them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from scenenet.core.errors import warn
from scenenet.core.files import read_json, write_json
from scenenet.core.outputs import check_space
from scenenet.core.progress import quiet, track
from scenenet.core.scratch import scratch_folder, temporary_directory
from scenenet.core.unchanged import FileState
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import SurveyTower
from scenenet.prediction.file_status import SurveyFile, readable
from scenenet.prediction.found_towers import FoundTowers, find_in_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_files import SurveyFiles, look_at
from scenenet.prediction.work.block_file import BlockFile
from scenenet.prediction.work.point_predictions import PointLookUp, PointPredictions
from scenenet.prediction.work.structures import Owners, Structures
from scenenet.prediction.work.survey_system import SurveySystem
from scenenet.prediction.work.survey_work import SurveyWork
from scenenet.prediction.work.tile_predictions import TilePredictions
from scenenet.prediction.work.tile_predictor import (
    fullest_voxel,
    observed_voxel_size,
    predict_file,
)
from scenenet.prediction.work.tiling import TileSpool
from scenenet.prediction.work.work_file import WorkFile, read_file
from scenenet.prediction.work.work_folder import WorkFolder

if TYPE_CHECKING:
    import pyproj

    from scenenet.models.base import VoxelModel
    from scenenet.models.model_file import ModelCard


Item = TypeVar("Item")

SCRATCH_BYTES = 20
"""Bytes of temporary files for a point: 12 for its position, and up to 3.1 for the voxels, measured
on airborne and mobile surveys."""


@dataclass(frozen=True)
class SurveyPrediction:
    """The predictions of a model for a survey.

    Attributes:
        survey: its files, as they were named.
        files: its files, as they were read.
        model, card: the model and what its file says about it.
        settings, detection: the settings of the prediction.
        system: the coordinates of the survey.
        spool: its voxels and points, by tiles of voxels.
        towers: the towers found, highest probability first, in the units of the survey.
        structures: their shapes, m.
        tiles: the predictions on disk; they exist inside the ``with`` block of ``predict_survey``.
        started: ``time.perf_counter()`` at the start.
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

    def warn(self) -> None:
        """Print what looks wrong about the files; what is wrong with several of them, once."""
        warn(self.survey.given, self.survey.notes)
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
        return PointLookUp(self.tiles, self.structures, self.spool.lattice, self.unit_sizes)

    @cached_property
    def _owners(self) -> Owners:
        return Owners(self.structures, self.spool.lattice)

    def owner(self, xyz: np.ndarray) -> np.ndarray:
        """(n,) uint32, id of the tower whose shape has each of the points (n, 3) m, 0 for none."""
        return self._owners(xyz)

    def taken(self, xyz: np.ndarray) -> np.ndarray:
        """(n,) bool, which points (n, 3) of the survey, in its units, are taken for the target of
        the model: points of towers for a model of towers, else points in voxels at or above tau."""
        points = self.look_up(xyz)
        if self.card.finds.is_tower:
            return points.tower_id > 0
        return points.probability >= self.card.threshold()

    def look_up(self, xyz: np.ndarray) -> PointPredictions:
        """Probability, tower id and shares of points (n, 3) of the survey, in its units."""
        return self.points(xyz)


@contextmanager
def predict_survey(
    survey: str | Path | SurveyFiles,
    model: str | Path,
    settings: PredictSettings,
    detection: DetectionSettings,
    work: WorkFolder | None = None,
) -> Iterator[SurveyPrediction]:
    """Predict every occupied voxel of a survey and, with a model of towers, find its towers.

    All files of a survey are read before towers are searched for, so the result does not depend on
    where the survey was cut. Memory is bounded by a chunk of points and a tile of voxels. The
    predictions lie in a temporary folder, which is removed at the end of the ``with`` block::

        with predict_survey("line.laz", "model.json", PredictSettings(), DetectionSettings()) as p:
            print(p.towers, p.look_up(xyz).probability)

    ``scenenet.prediction.writers`` writes a prediction to files.

    Args:
        survey: LAS, LAZ, COPC or TS40K sample; a folder, a pattern or a tile index of LAS and LAZ
            files, of which one that cannot be used has its error in ``files``.
        model: model file with tau.
        work: folder for the files between the stages, with those of an earlier call that was
            stopped; None for a temporary one.

    Raises:
        InputError: the survey or the model cannot be used.
        OutputError: the disk of the temporary files has too little space.
    """
    from scenenet.models.model_file import read_model

    started = time.perf_counter()
    if not isinstance(survey, SurveyFiles):
        survey = SurveyFiles.of(survey)
    trained, card = read_model(model)
    tau = card.threshold()  # fail before the work: without tau there is no tower
    voxel_size = observed_voxel_size(trained, card, settings)
    headers, _ = look_at(survey)
    size = SCRATCH_BYTES * sum(info.n_points for info in headers.values())
    place = temporary_directory() if work is None else work.folder
    check_space({place: size - (0 if work is None else work.bytes_kept())})
    with nullcontext(work) if work is not None else _scratch() as folder:
        _read_files(survey, folder, voxel_size, settings.chunk_points)
        joined = SurveyWork.open(survey, folder.reads(survey))
        tiles = _predict_files(joined, folder, trained, card)
        if not folder.towers.exists() and not card.finds.is_tower:
            write_json(folder.towers, FoundTowers.none().to_json())
        if not folder.towers.exists():
            label = f"{survey.given.name}: candidates measured"
            sizes = joined.system.unit_sizes
            found = find_in_survey(joined.spool, tiles, sizes, tau, detection, label)
            write_json(folder.towers, found.to_json())
        found = FoundTowers.from_json(read_json(folder.towers))
        yield SurveyPrediction.of(
            joined,
            tiles,
            found,
            model=trained,
            card=card,
            settings=settings,
            detection=detection,
            started=started,
        )


@contextmanager
def _scratch() -> Iterator[WorkFolder]:
    with scratch_folder() as folder:
        yield WorkFolder(folder)


def _read_files(
    survey: SurveyFiles, folder: WorkFolder, voxel_size: float, chunk_points: int
) -> None:
    """Read the files that are not in ``folder`` yet."""
    names, reads = survey.names, folder.reads(survey)

    def read(path: Path) -> None:
        read_file(path, names[path], reads[path], voxel_size, chunk_points, survey.crs)

    left = [path for path, out in reads.items() if not out.exists()]
    _each(left, f"{survey.given.name}: files read", read)


def _predict_files(
    joined: SurveyWork, folder: WorkFolder, model: VoxelModel, card: ModelCard
) -> TilePredictions:
    """Predict the tiles of the files that are not in ``folder`` yet; each tile once."""
    fullest = fullest_voxel(joined.spool, card)
    files: list[BlockFile] = []
    done: set[int] = set()

    def predict(work: WorkFile) -> None:
        out = folder.predicted(work.file.name)
        if not out.exists():
            predict_file(work, joined.spool, out, model, card, fullest, done=done)
        files.append(BlockFile(out))
        done.update(files[-1].codes("predictions"))

    _each(joined.used, f"{joined.survey.given.name}: files predicted", predict)
    return TilePredictions(files)


def _each(items: Sequence[Item], label: str, step: Callable[[Item], None]) -> None:
    """Take a step for each item and report progress: the step's own where there is one item."""
    if len(items) == 1:
        step(items[0])
        return
    for item in track(items, label):
        with quiet():
            step(item)
