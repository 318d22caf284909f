"""Writes the points of a file of a survey back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from scenenet.core.files import atomic, read_json, write_json
from scenenet.core.provenance import fingerprint, is_still
from scenenet.core.unchanged import FileState
from scenenet.prediction.point_dimensions import TOWER_CODE
from scenenet.prediction.point_writer import write_points
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.work.block_file import BlockFile
from scenenet.prediction.work.point_predictions import PointLookUp, TargetTiles
from scenenet.prediction.work.structures import Structures
from scenenet.prediction.work.survey_system import SurveySystem
from scenenet.prediction.work.tile_predictions import TilePredictions
from scenenet.prediction.work.work_file import WorkFile

if TYPE_CHECKING:
    import pyproj


def write_tile(
    work: str | Path,
    predictions: str | Path,
    near: str | Path,
    points: str | Path,
    record: str | Path,
    settings: PredictSettings,
    crs: pyproj.CRS | None,
    known: str | None = None,
) -> None:
    """Write the points of a file of a survey, and what was counted in them.

    Args:
        work, predictions: of the file.
        near: the towers that reach into it, as ``find_towers_of`` wrote them.
        points: LAZ file to write.
        record: file to write (``SurveyFile``).
        crs: system of a file that states none; None if it is not known.
        known: fingerprint of the file. A copy of the file that was read has the same one, and may
            have taken its place; None if only that file itself may be written.

    Raises:
        InputError: the file changed after it was read.
    """
    own, facts = WorkFile.open(work), read_json(near)
    system = SurveySystem.from_json(facts["system"])
    tiles = TargetTiles(TilePredictions([BlockFile(predictions)]), own.lattice, code=TOWER_CODE)
    structures = Structures.from_json(facts["structures"])
    look_up = PointLookUp([tiles], structures, system.unit_sizes)
    file = own.file
    if known is not None and known == own.known and is_still(file.path, known):
        file = replace(file, state=FileState.of(file.path))
    with atomic(points) as partial:
        file = write_points(file, look_up, partial, settings, crs)
    written = {"file": file.to_record(), "fingerprint": fingerprint(points)}
    write_json(record, written)
