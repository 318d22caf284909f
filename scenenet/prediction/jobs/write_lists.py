"""Writes the lists of a survey, once the points of its files are written."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from scenenet.core.files import read_json
from scenenet.detection.settings import DetectionSettings
from scenenet.prediction.file_status import SurveyFile
from scenenet.prediction.found_towers import FoundTowers
from scenenet.prediction.jobs.joined import joined_predictions, joined_work
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.summary import PredictionSummary
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.survey_prediction import SurveyPrediction
from scenenet.prediction.writers import write_all_lists


def write_lists(
    survey: SurveyFiles,
    works: Sequence[str | Path],
    predictions: Sequence[str | Path],
    towers: str | Path,
    records: Sequence[str | Path],
    model: str | Path,
    files: PredictionFiles,
    settings: PredictSettings,
    detection: DetectionSettings,
) -> PredictionSummary:
    """Write the tower list, the status and the summary of a survey whose points are written.

    Args:
        works, predictions: as ``find_towers_of``.
        towers: what it found.
        records: of the files whose points were written (``write_tile``).
        model: model file.
        files: the results.

    Raises:
        InputError: no file can be used, or the model cannot be.
        OutputError: a file cannot be written.
    """
    from scenenet.models.model_file import read_model

    started = time.perf_counter()
    trained, card = read_model(model)
    joined = joined_work(survey, works)
    written: dict[str, tuple[SurveyFile, str]] = {}
    for record in map(read_json, records):
        file = SurveyFile.from_record(record["file"])
        written[file.name] = file, record["fingerprint"]
    prediction = SurveyPrediction.of(
        joined,
        joined_predictions(joined, predictions),
        FoundTowers.from_json(read_json(towers)),
        model=trained,
        card=card,
        settings=settings,
        detection=detection,
        started=started,
    )
    read = tuple(written.get(file.name, (file, ""))[0] for file in joined.files)
    prediction = replace(prediction, files=read)
    prediction.warn()
    outputs = {files.key(files.points[f.path]): known for f, known in written.values()}
    return write_all_lists(prediction, files, outputs)
