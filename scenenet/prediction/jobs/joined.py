"""The work files of a survey, joined."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from scenenet.core.files import atomic, write_json
from scenenet.prediction.survey_files import SurveyFiles, result_name
from scenenet.prediction.work.block_file import BlockFile
from scenenet.prediction.work.survey_work import SurveyWork
from scenenet.prediction.work.tile_predictions import TilePredictions
from scenenet.prediction.work.tile_predictor import fullest_voxel
from scenenet.prediction.work.work_file import WorkFile


def joined_work(survey: SurveyFiles, works: Sequence[str | Path]) -> SurveyWork:
    """The work files of all files of a survey that are not refused, in order, as one survey.

    Raises:
        InputError: no file can be used.
    """
    paths = [path for path in survey.files if path not in survey.refused]
    return SurveyWork.open(survey, dict(zip(paths, map(Path, works), strict=True)))


def joined_predictions(joined: SurveyWork, predictions: Sequence[str | Path]) -> TilePredictions:
    """The predictions for the files of a survey. Those of a file in another coordinate system are
    left out: it was predicted by itself, perhaps at the same numbers.

    Args:
        predictions: of each file of the survey that is not refused, in order.
    """
    paths = [path for path in joined.survey.files if path not in joined.survey.refused]
    used = {work.file.path for work in joined.used}
    each = zip(paths, predictions, strict=True)
    return TilePredictions([BlockFile(file) for path, file in each if path in used])


def write_near(
    joined: SurveyWork, near: str | Path, reaching: Callable[[WorkFile], Mapping[str, Any]]
) -> None:
    """Write what of a survey reaches into each of its files: a JSON file for each that can be used,
    with the system of the survey.

    Args:
        near: folder to write. A file in it stays the same to the byte while its content does.
        reaching: gives what reaches into a file, as JSON.

    Raises:
        OutputError: the folder cannot be written.
    """
    with atomic(near) as folder:
        folder.mkdir()
        for work in _usable(joined):
            facts = {"system": joined.system.to_json(), **reaching(work)}
            write_json(folder / f"{result_name(work.file.name)}.json", facts)


def _usable(joined: SurveyWork) -> Iterator[WorkFile]:
    """The work files of the files of a survey that can be used."""
    names = {file.name for file in joined.files if file.error is None}
    return (work for work in joined.used if work.file.name in names)


def fullest_in(survey: SurveyFiles, works: Sequence[str | Path], model: str | Path) -> int:
    """Points in the fullest voxel of a survey.

    Args:
        works: the work file of each file of the survey that is not refused, in order.

    Raises:
        InputError: no file can be used.
    """
    from scenenet.models.model_file import read_model

    return fullest_voxel(joined_work(survey, works).spool, read_model(model)[1])
