"""Finds the towers of a survey, and the files that each reaches into."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from scenenet.core.files import write_json
from scenenet.detection.settings import DetectionSettings
from scenenet.prediction.found_towers import TowerSearch, find_in_survey
from scenenet.prediction.jobs.joined import joined_predictions, joined_work, write_near
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.work.work_file import WorkFile


def find_towers_of(
    survey: SurveyFiles,
    works: Sequence[str | Path],
    predictions: Sequence[str | Path],
    model: str | Path,
    detection: DetectionSettings,
    towers: str | Path,
    near: str | Path,
) -> None:
    """Find the towers of a survey.

    Args:
        works, predictions: the work file and the predictions of each file of the survey that is not
            refused, in order.
        model: model file.
        towers: file to write (``FoundTowers``).
        near: folder to write, with a file for each file of the survey that can be used: the towers
            that reach into it. It stays the same to the byte while these do.

    Raises:
        InputError: no file can be used, or the model cannot be.
    """
    from scenenet.models.model_file import read_model

    tau = read_model(model)[1].threshold()
    joined = joined_work(survey, works)
    tiles = joined_predictions(joined, predictions)
    search = TowerSearch(joined.spool, tiles, joined.system.unit_sizes, tau, detection)
    found = find_in_survey(search, survey.name)
    write_json(towers, found.to_json())

    def reaching(work: WorkFile) -> Mapping[str, Any]:
        own = found.structures.reaching(work.lattice, work.blocks.codes("voxels"))
        return {"structures": own.to_json()}

    write_near(joined, near, reaching)
