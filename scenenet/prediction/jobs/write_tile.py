"""Writes the points of a file of a survey back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from scenenet.core.files import atomic, read_json, write_json
from scenenet.core.provenance import fingerprint, is_still
from scenenet.core.unchanged import FileState
from scenenet.line.records import Conductor, SurveyLine
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.prediction.point_writer import write_points
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.used_models import code_of_target
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
    predictions: Sequence[str | Path],
    near: str | Path,
    points: str | Path,
    record: str | Path,
    settings: PredictSettings,
    crs: pyproj.CRS | None,
    known: str | None = None,
    scheme: ClassScheme | None = None,
) -> None:
    """Write the points of a file of a survey, and what was counted in them.

    Args:
        work, predictions: of the file; the predictions of the model of towers first.
        near: the towers that reach into it, as ``find_towers_of`` wrote them, or with the
            conductors, as ``find_line_of`` did.
        points: LAZ file to write.
        record: file to write (``SurveyFile``).
        crs: system of a file that states none; None if it is not known.
        known: fingerprint of the file. A copy of the file that was read has the same one, and may
            have taken its place; None if only that file itself may be written.
        scheme: of the class codes in the survey (``scenenet.prediction.used_models.use_models``).

    Raises:
        InputError: the file changed after it was read.
    """
    own, facts = WorkFile.open(work), read_json(near)
    system = SurveySystem.from_json(facts["system"])
    each = (TilePredictions([BlockFile(file)]) for file in predictions)
    models = [
        TargetTiles(p, p.lattice, p.target, p.tau, code_of_target(p.target, scheme)) for p in each
    ]
    structures = Structures.from_json(facts["structures"])
    line = None
    if "conductors" in facts:
        line = SurveyLine((), tuple(map(Conductor.from_json, facts["conductors"])), ())
    look_up = PointLookUp(models, structures, system.unit_sizes, line)
    file = own.file
    if known is not None and known == own.known and is_still(file.path, known):
        file = replace(file, state=FileState.of(file.path))
    with atomic(points) as partial:
        file = write_points(file, look_up, partial, settings, crs)
    written = {"file": file.to_record(), "fingerprint": fingerprint(points)}
    write_json(record, written)
