"""Prediction of a whole survey: tiles with a halo, then towers, then the points."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError, OutputError, in_file, warn
from scenenet.core.outputs import check_space
from scenenet.core.progress import track
from scenenet.core.scratch import scratch_folder, temporary_directory
from scenenet.core.unchanged import FileState, unchanged
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import SurveyTower
from scenenet.pointcloud import iter_chunks
from scenenet.pointcloud.quality.screening import Screening
from scenenet.pointcloud.reading import SurveyInfo
from scenenet.prediction.file_status import SurveyFile, readable
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_files import SurveyFiles, look_at, nothing_to_use
from scenenet.prediction.tile_predictions import PointPredictions, TilePredictions
from scenenet.prediction.tiling import TileSpool

if TYPE_CHECKING:
    import pyproj

    from scenenet.models.base import VoxelModel
    from scenenet.models.model_file import ModelCard


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
        crs: CRS of the survey; None where its files name none.
        unit_sizes, unit_names: sizes in m of the units of its x, y and z, and their names.
        n_tiles: tiles of voxels that hold a point.
        voxel_size: m.
        towers: the towers found, highest probability first, in the units of the survey.
        tiles: the predictions on disk; they exist inside the ``with`` block of ``predict_survey``.
        started: ``time.perf_counter()`` at the start.
    """

    survey: SurveyFiles
    files: tuple[SurveyFile, ...]
    model: VoxelModel
    card: ModelCard
    settings: PredictSettings
    detection: DetectionSettings
    crs: pyproj.CRS | None
    unit_sizes: tuple[float, float, float]
    unit_names: tuple[str, str, str]
    n_tiles: int
    voxel_size: float
    towers: tuple[SurveyTower, ...]
    tiles: TilePredictions
    started: float

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

    @property
    def spool(self) -> TileSpool:
        """Its voxels and points, by tiles of voxels."""
        return self.tiles.spool

    def owner(self, xyz: np.ndarray) -> np.ndarray:
        """(n,) uint32, id of the tower whose shape has each of the points (n, 3) m, 0 for none."""
        return self.tiles.owner(xyz)

    def look_up(self, xyz: np.ndarray) -> PointPredictions:
        """Probability, tower id and shares of points (n, 3) of the survey, in its units."""
        return self.tiles.look_up(in_metres(xyz, self.unit_sizes))


@contextmanager
def predict_survey(
    survey: str | Path | SurveyFiles,
    model: str | Path,
    settings: PredictSettings,
    detection: DetectionSettings,
) -> Iterator[SurveyPrediction]:
    """Predict every occupied voxel of a survey and find its towers.

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

    Raises:
        InputError: the survey or the model cannot be used.
        OutputError: the disk of the temporary files has too little space.
    """
    from scenenet.models.geneo_model import GeneoModel
    from scenenet.models.model_file import read_model

    started = time.perf_counter()
    if not isinstance(survey, SurveyFiles):
        survey = SurveyFiles.of(survey)
    trained, card = read_model(model)
    tau = card.threshold()  # fail before the work: without tau there is no tower
    geneos = trained.names if isinstance(trained, GeneoModel) else []
    voxel_size = trained.observed_size(settings.voxel_size or card.voxel_size)
    with scratch_folder() as scratch:
        spool = TileSpool(scratch, voxel_size)
        files, info = read_files(survey, spool, settings.chunk_points)
        tiles = TilePredictions(spool, scratch, geneos)
        tiles.compute(trained, card, f"{survey.given.name}: tiles predicted")
        found = tiles.find_towers(tau, detection)
        yield SurveyPrediction(
            survey=survey,
            files=files,
            model=trained,
            card=card,
            settings=settings,
            detection=detection,
            crs=info.crs,
            unit_sizes=info.unit_sizes,
            unit_names=info.unit_names,
            n_tiles=len(spool),
            voxel_size=voxel_size,
            towers=tuple(tower.in_units(info.unit_sizes) for tower in found),
            tiles=tiles,
            started=started,
        )


def read_files(
    survey: SurveyFiles, spool: TileSpool, chunk_points: int
) -> tuple[tuple[SurveyFile, ...], SurveyInfo]:
    """Read all files of a survey into ``spool``.

    The points of a damaged file before its damage stay in ``spool``, as surroundings of its
    neighbours.

    Returns:
        the files, and the header of the first one that can be used; all have its CRS and units.

    Raises:
        InputError: no file can be used, or, of a survey that is one file, that one.
    """
    headers, errors = look_at(survey)
    check_space({temporary_directory(): SCRATCH_BYTES * sum(i.n_points for i in headers.values())})
    files, names = [], survey.names
    for path in survey.files:
        try:
            if path in errors:
                raise errors[path]
            read = _read(path, headers[path], spool, chunk_points)
            files.append(replace(read, name=names[path]))
        except OutputError:
            raise
        except InputError as error:
            if not survey.tiled:
                raise
            files.append(SurveyFile(path, names[path], error=error))
    if not any(readable(files)):
        raise nothing_to_use(survey, [file.error for file in files if file.error is not None])
    return tuple(files), next(iter(headers.values()))


def _read(path: Path, info: SurveyInfo, spool: TileSpool, chunk_points: int) -> SurveyFile:
    """Read a file into ``spool``, and look at it."""
    screening, n_points, state = Screening(info, converted=True), 0, FileState.of(path)
    with unchanged(state), in_file(path):
        chunks = iter_chunks(path, chunk_points=chunk_points)
        for chunk in track(chunks, f"{path.name}: chunks read"):
            screening.add(chunk.xyz, chunk.classification)
            spool.add(in_metres(chunk.xyz, info.unit_sizes))
            n_points += len(chunk)
    screening.raise_if_not_metres()
    extent = (*screening.mins[:2].tolist(), *screening.maxs[:2].tolist()) if n_points else None
    return SurveyFile(path, path.name, state, n_points, extent, warnings=screening.warnings())


def in_metres(xyz: np.ndarray, unit_sizes: tuple[float, float, float]) -> np.ndarray:
    """Coordinates (n, 3) in units of these sizes, as metres; metres stay the same to the bit."""
    return xyz if unit_sizes == (1.0, 1.0, 1.0) else xyz * unit_sizes
