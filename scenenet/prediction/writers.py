"""Files of a prediction: the classified survey (LAZ), the tower list, the summary."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from scenenet.core.files import atomic, write_json
from scenenet.core.provenance import fingerprint, package_version
from scenenet.detection.settings import DetectionSettings
from scenenet.pointcloud.copc import write_copc
from scenenet.prediction.file_status import write_status
from scenenet.prediction.page.survey_page import write_page
from scenenet.prediction.predict import SurveyPrediction, predict_survey
from scenenet.prediction.result_files import PredictionFiles, copc_of
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.summary import PredictionSummary
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.tile_results import write_file, write_tiles
from scenenet.prediction.tower_lists import write_csv, write_geojson, write_geopackage
from scenenet.prediction.work.work_folder import WorkFolder, resumable


def predict_to_files(
    survey: str | Path | SurveyFiles,
    model: str | Path,
    files: PredictionFiles,
    settings: PredictSettings,
    detection: DetectionSettings,
    code: str | None = None,
) -> PredictionSummary:
    """Predict a survey and write the classified points, the tower list and the summary.

    The survey is read twice: once for its occupied voxels, once to write every point back. Of a
    survey that is one file, all results appear, or none. Of one with several files, each file
    appears whole; one that fails stops no other and is named in the summary, in the layer ``tiles``
    and in the status.

    Args:
        survey: LAS, LAZ, COPC or TS40K sample; a folder, a pattern or a tile index of LAS and LAZ
            files.
        model: model file with tau.
        files: to write.
        code: digest of the code; a run goes on where one with the same code was stopped. None for
            the version of the package.

    Raises:
        InputError: the survey or the model cannot be used.
        OutputError: a file cannot be written.
    """
    if not isinstance(survey, SurveyFiles):
        survey = SurveyFiles.of(survey)
    with ExitStack() as stack:
        work = None
        if files.work is not None:
            made_by = _made_by(survey, model, settings, detection, code or package_version())
            work = stack.enter_context(resumable(files.work, survey, made_by))
        prediction = stack.enter_context(predict_survey(survey, model, settings, detection, work))
        prediction.warn()
        return _write_all(prediction, files, work)


def _write_all(
    prediction: SurveyPrediction, files: PredictionFiles, work: WorkFolder | None
) -> PredictionSummary:
    """Write the points, then the lists, then the summary."""
    with ExitStack() as stack:
        written: dict[str, str] = {}
        if work is not None:
            read = write_tiles(prediction, files, written, work)
        else:
            [target] = files.points.values()
            partial = stack.enter_context(atomic(target))
            [file] = prediction.files
            read = (write_file(file, prediction, partial),)
            written[files.key(target)] = fingerprint(partial)
            if files.copc:
                copc = stack.enter_context(atomic(copc_of(target)))
                write_copc(partial, copc)
                written[files.key(copc_of(target))] = fingerprint(copc)
        summary = _write_lists(stack, replace(prediction, files=read), files, written)
    files.unfinished.unlink(missing_ok=True)
    return summary


def write_all_lists(
    prediction: SurveyPrediction, files: PredictionFiles, written: dict[str, str]
) -> PredictionSummary:
    """Write the tower list, the status and the summary of a survey.

    Args:
        files: the results; those of the points are there.
        written: fingerprint of each of these, by its key.
    """
    with ExitStack() as stack:
        return _write_lists(stack, prediction, files, written)


def _write_lists(
    stack: ExitStack,
    prediction: SurveyPrediction,
    files: PredictionFiles,
    written: dict[str, str],
) -> PredictionSummary:
    """Write the tower list, the status and the summary; they appear when ``stack`` is left."""
    lists = {path: stack.enter_context(atomic(path)) for path in files.lists}
    record = stack.enter_context(atomic(files.summary))
    of_towers = (files.geopackage, files.geojson, files.table)
    write_towers(prediction, *(lists[path] for path in of_towers))
    if files.page is not None:
        write_page(prediction, lists[files.page])
    if files.status is not None:
        write_status(lists[files.status], prediction.files)
    prints = {files.key(path): fingerprint(partial) for path, partial in lists.items()}
    summary = summarise(prediction, written | prints)
    write_json(record, summary.to_json())
    return summary


def _made_by(
    survey: SurveyFiles,
    model: str | Path,
    settings: PredictSettings,
    detection: DetectionSettings,
    code: str,
) -> dict[str, Any]:
    """All that decides on the results of a survey besides its files, as JSON holds it."""
    return {
        "model": fingerprint(model),
        "settings": settings.model_dump(mode="json"),
        "detection": detection.model_dump(mode="json"),
        "crs": None if survey.crs is None else survey.crs.srs,
        "code": code,
    }


def write_towers(
    prediction: SurveyPrediction, geopackage: Path, geojson: Path, table: Path
) -> None:
    """Write the tower list in each of its formats."""
    towers, geneos = prediction.towers, prediction.geneos
    crs, sizes = prediction.crs, prediction.unit_sizes
    spool, files = prediction.spool, prediction.files
    write_geopackage(geopackage, towers, geneos, crs, sizes, spool, files)
    write_geojson(geojson, towers, crs, sizes)
    write_csv(table, towers, geneos)


def summarise(prediction: SurveyPrediction, outputs: dict[str, str]) -> PredictionSummary:
    """The summary of a prediction with the files ``outputs``; ``seconds`` counts up to now."""
    detection = {"detection": prediction.detection.model_dump()}
    crs = prediction.crs
    return PredictionSummary(
        survey=str(prediction.survey.given),
        model=prediction.card.name,
        points=prediction.n_points,
        towers=len(prediction.towers),
        tau=prediction.card.threshold(),
        voxel_size_m=prediction.voxel_size,
        kernel_size=list(prediction.model.kernel_size),
        tiles=prediction.n_tiles,
        crs=None if crs is None else crs.to_string(),
        unit_sizes_m=list(prediction.unit_sizes),
        units=list(prediction.unit_names),
        warnings=[
            *prediction.survey.notes,
            *(text for file in prediction.files for text in file.warnings),
        ],
        files=[file.to_json() for file in prediction.files],
        seconds=time.perf_counter() - prediction.started,
        settings=prediction.settings.model_dump() | detection,
        model_provenance=prediction.card.provenance,
        outputs=outputs,
    )
