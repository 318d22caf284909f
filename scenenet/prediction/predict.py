"""Prediction of a whole survey: tiles with a halo, then towers, then the points."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import in_file
from scenenet.core.outputs import check_space
from scenenet.core.progress import track
from scenenet.core.scratch import scratch_folder, temporary_directory
from scenenet.core.unchanged import FileState, unchanged
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import SurveyTower
from scenenet.pointcloud import iter_chunks, survey_in_metres
from scenenet.pointcloud.quality.screening import Screening
from scenenet.prediction.settings import PredictSettings
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
        survey: the file of the survey.
        state: its state before the first pass; a later pass must find the same.
        warnings: what looks wrong about it, as sentences.
        model, card: the model and what its file says about it.
        settings, detection: the settings of the prediction.
        crs: CRS of the survey; None where the file names none.
        n_points, n_tiles: points of the survey, and tiles that hold a point.
        voxel_size: m.
        towers: the towers found, highest probability first.
        tiles: the predictions on disk; they exist inside the ``with`` block of ``predict_survey``.
        started: ``time.perf_counter()`` at the start.
    """

    survey: Path
    state: FileState
    warnings: tuple[str, ...]
    model: VoxelModel
    card: ModelCard
    settings: PredictSettings
    detection: DetectionSettings
    crs: pyproj.CRS | None
    n_points: int
    n_tiles: int
    voxel_size: float
    towers: tuple[SurveyTower, ...]
    tiles: TilePredictions
    started: float

    @property
    def geneos(self) -> tuple[str, ...]:
        """Names of the GENEOs that the shares belong to; empty for a model without GENEOs."""
        return self.tiles.geneos

    def look_up(self, xyz: np.ndarray) -> PointPredictions:
        """Probability, tower id and shares of points (n, 3) m of the survey."""
        return self.tiles.look_up(xyz)


@contextmanager
def predict_survey(
    survey: str | Path,
    model: str | Path,
    settings: PredictSettings,
    detection: DetectionSettings,
) -> Iterator[SurveyPrediction]:
    """Predict every occupied voxel of a survey and find its towers.

    Memory is bounded by a chunk of points and a tile of voxels. The predictions lie in a temporary
    folder, which is removed at the end of the ``with`` block::

        with predict_survey("line.laz", "model.json", PredictSettings(), DetectionSettings()) as p:
            print(p.towers, p.look_up(xyz).probability)

    ``scenenet.prediction.writers`` writes a prediction to files.

    Args:
        survey: LAS, LAZ, COPC or TS40K sample.
        model: model file with tau.

    Raises:
        InputError: the survey or the model cannot be used.
        OutputError: the disk of the temporary files has too little space.
    """
    from scenenet.models.geneo_model import GeneoModel
    from scenenet.models.model_file import read_model

    started = time.perf_counter()
    trained, card = read_model(model)
    tau = card.threshold()  # fail before the work: without tau there is no tower
    geneos = trained.names if isinstance(trained, GeneoModel) else []
    voxel_size = trained.observed_size(settings.voxel_size or card.voxel_size)
    state = FileState.of(survey)
    name, info = Path(survey).name, survey_in_metres(survey)
    check_space({temporary_directory(): SCRATCH_BYTES * info.n_points})
    screening = Screening(info)
    with scratch_folder() as scratch:
        spool = TileSpool(scratch, voxel_size)
        with unchanged(state), in_file(survey):
            n_points = _read(survey, spool, screening, settings.chunk_points)
        screening.raise_if_not_metres()
        tiles = TilePredictions(spool, scratch, geneos)
        tiles.compute(trained, card, f"{name}: tiles predicted")
        towers = tuple(tiles.find_towers(tau, detection))
        yield SurveyPrediction(
            survey=Path(survey),
            state=state,
            warnings=screening.warnings(),
            model=trained,
            card=card,
            settings=settings,
            detection=detection,
            crs=info.crs,
            n_points=n_points,
            n_tiles=len(spool),
            voxel_size=voxel_size,
            towers=towers,
            tiles=tiles,
            started=started,
        )


def _read(survey: str | Path, spool: TileSpool, screening: Screening, chunk_points: int) -> int:
    """Read a survey into ``spool`` and ``screening``; the number of its points."""
    n_points = 0
    chunks = iter_chunks(survey, chunk_points=chunk_points)
    for chunk in track(chunks, f"{Path(survey).name}: chunks read"):
        screening.add(chunk.xyz, chunk.classification)
        spool.add(chunk.xyz)
        n_points += len(chunk)
    return n_points
