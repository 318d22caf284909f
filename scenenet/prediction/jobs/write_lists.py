"""Writes the lists of a survey, once the points of its files are written."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from scenenet.clearance.records import SurveyClearances
from scenenet.clearance.settings import ClearanceSettings
from scenenet.core.files import read_json
from scenenet.detection.settings import DetectionSettings
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.prediction.file_status import SurveyFile
from scenenet.prediction.found_line import FoundLine
from scenenet.prediction.found_towers import FoundTowers
from scenenet.prediction.jobs.joined import joined_predictions, joined_work
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.summary import PredictionSummary
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.survey_prediction import FurtherModel, SurveyPrediction
from scenenet.prediction.used_models import use_models
from scenenet.prediction.writers import write_all_lists


def write_lists(
    survey: SurveyFiles,
    works: Sequence[str | Path],
    predictions: Sequence[Sequence[str | Path]],
    towers: str | Path,
    records: Sequence[str | Path],
    models: Sequence[str | Path],
    files: PredictionFiles,
    settings: PredictSettings,
    detection: DetectionSettings,
    line: str | Path | None = None,
    clearances: str | Path | None = None,
    clearance: ClearanceSettings | None = None,
    scheme: ClassScheme | None = None,
) -> PredictionSummary:
    """Write the tower list, the status and the summary of a survey whose points are written.

    Args:
        works: as ``find_towers_of``.
        predictions: of each model those of each file of the survey that is not refused, in order.
        towers: what it found.
        records: of the files whose points were written (``write_tile``).
        models: model files, that of towers first.
        files: the results.
        line, clearances: what ``find_line_of`` and ``find_clearances_of`` found; None where no
            lines were looked for.
        clearance: settings of the clearances.
        scheme: of the class codes in the survey.

    Raises:
        InputError: no file can be used, or the model cannot be.
        OutputError: a file cannot be written.
    """
    started = time.perf_counter()
    used = {each.path: each for each in use_models(models, settings, scheme)}
    first, *others = (used[Path(model)] for model in models)
    joined = joined_work(survey, works)
    written: dict[str, tuple[SurveyFile, str]] = {}
    for record in map(read_json, records):
        file = SurveyFile.from_record(record["file"])
        written[file.name] = file, record["fingerprint"]
    found = FoundTowers.from_json(read_json(towers))
    lines = None if line is None else FoundLine.from_json(read_json(line))
    tiles, *further = (joined_predictions(joined, each) for each in predictions)
    prediction = SurveyPrediction.of(
        joined,
        tiles,
        found if lines is None else lines.towers,
        model=first.model,
        card=first.card,
        settings=settings,
        detection=detection,
        started=started,
        code=first.code,
        further=[
            FurtherModel(each, joined.spool_at(each.layer), predicted)
            for each, predicted in zip(others, further, strict=True)
        ],
        line=None if lines is None else lines.line,
        clearance=clearance,
        clearances=None
        if clearances is None
        else SurveyClearances.from_json(read_json(clearances)),
        # The work files keep the class codes for the clearances only.
        scheme=None if clearances is None else scheme,
    )
    read = tuple(written.get(file.name, (file, ""))[0] for file in joined.files)
    prediction = replace(prediction, files=read)
    prediction.warn()
    outputs = {files.key(files.points[f.path]): known for f, known in written.values()}
    return write_all_lists(prediction, files, outputs)
