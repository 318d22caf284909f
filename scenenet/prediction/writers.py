"""Files of a prediction: the classified survey (LAZ), the tower list, the summary."""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from scenenet.clearance.records import SurveyClearances
from scenenet.clearance.settings import ClearanceSettings
from scenenet.core.errors import InputError
from scenenet.core.files import atomic, write_json
from scenenet.core.free_memory import give_back
from scenenet.core.provenance import fingerprint, package_version
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import row_types
from scenenet.line.records import AS_FLOWN, SurveyLine
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.pointcloud.copc import write_copc
from scenenet.prediction.clearance_lists import write_clearance_layers, write_clearances_csv
from scenenet.prediction.file_status import write_status
from scenenet.prediction.found_line import Rejects
from scenenet.prediction.line_lists import (
    write_conductors_csv,
    write_line_layers,
    write_spans_csv,
)
from scenenet.prediction.page.survey_page import write_page
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.result_files import PredictionFiles, copc_of
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.summary import PredictionSummary
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.survey_prediction import SurveyPrediction
from scenenet.prediction.tile_results import write_file, write_tiles
from scenenet.prediction.tower_lists import write_csv, write_geojson, write_geopackage
from scenenet.prediction.used_models import ModelPaths, paths_of, use_models
from scenenet.prediction.work.work_folder import WorkFolder, resumable


def predict_to_files(
    survey: str | Path | SurveyFiles,
    models: ModelPaths,
    files: PredictionFiles,
    settings: PredictSettings,
    detection: DetectionSettings,
    code: str | None = None,
    scheme: ClassScheme | None = None,
    clearance: ClearanceSettings | None = None,
    rejects: Rejects | None = None,
) -> PredictionSummary:
    """Predict a survey and write the classified points, the tower list and the summary.

    The survey is read twice: once for its occupied voxels, once to write every point back. Of a
    survey that is one file, all results appear, or none. Of one with several files, each file
    appears whole; one that fails stops no other and is named in the summary, in the layer ``tiles``
    and in the status.

    Args:
        survey: LAS, LAZ, COPC or TS40K sample; a folder, a pattern or a tile index of LAS and LAZ
            files.
        models: model file with tau, or several for different targets.
        files: to write; without tower lists and page if no model finds towers.
        code: digest of the code; a run goes on where one with the same code was stopped. None for
            the version of the package.
        scheme: of the class codes in the survey (``scenenet.prediction.used_models.use_models``).
        clearance: how clearances of lines are measured; None for the defaults.
        rejects: conductors that people rejected; None for none.

    Raises:
        InputError: the survey or a model cannot be used, or ``files`` has tower lists and no model
            finds towers.
        OutputError: a file cannot be written.
    """
    if not isinstance(survey, SurveyFiles):
        survey = SurveyFiles.of(survey)
    first, *_ = use_models(models, settings, scheme)
    if files.table is not None and not first.target.is_tower:
        raise InputError(
            f"it finds {first.target.name}, and a list of towers needs a model of towers",
            file=first.path,
            remedy="Name a model of towers as well",
        )
    with ExitStack() as stack:
        work = None
        if files.work is not None:
            made_by = _made_by(
                survey, models, settings, detection, code or package_version(), scheme, clearance,
                rejects,
            )  # fmt: skip
            work = stack.enter_context(resumable(files.work, survey, made_by))
        prediction = stack.enter_context(
            predict_survey(survey, models, settings, detection, work, scheme, clearance, rejects)
        )
        prediction.warn()
        return _write_all(prediction, files, work)


def _write_all(
    prediction: SurveyPrediction, files: PredictionFiles, work: WorkFolder | None
) -> PredictionSummary:
    """Write the points, then the lists, then the summary."""
    with ExitStack() as stack:
        written: dict[str, str] = {}
        outdated = files.outdated()
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
        give_back()
        summary = _write_lists(stack, replace(prediction, files=read), files, written)
    files.unfinished.unlink(missing_ok=True)
    for path in outdated:
        print(f"{path}: removed, because no towers were looked for this time", file=sys.stderr)
        path.unlink(missing_ok=True)
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
    if files.geojson is not None:
        crs, sizes = prediction.crs, prediction.unit_sizes
        write_geojson(lists[files.geojson], prediction.towers, crs, sizes)
    if files.table is not None:
        write_csv(lists[files.table], prediction.towers, row_types(prediction.geneos))
    if files.line_tables is not None and prediction.line is not None:
        spans, conductors, clearances = (lists[path] for path in files.line_tables)
        write_spans_csv(spans, prediction.line, prediction.unit_sizes)
        write_conductors_csv(conductors, prediction.line, prediction.unit_sizes)
        if prediction.clearances is not None:
            write_clearances_csv(clearances, prediction.clearances, prediction.unit_sizes)
    give_back()
    if files.page is not None:
        write_page(prediction, lists[files.page])
        give_back()
    # The last of what takes memory: the library of GeoPackages stays in it.
    write_layers(prediction, lists[files.geopackage])
    if files.status is not None:
        write_status(lists[files.status], prediction.files, prediction.target_names)
    prints = {files.key(path): fingerprint(partial) for path, partial in lists.items()}
    summary = summarise(prediction, written | prints)
    write_json(record, summary.to_json())
    return summary


def _made_by(
    survey: SurveyFiles,
    models: ModelPaths,
    settings: PredictSettings,
    detection: DetectionSettings,
    code: str,
    scheme: ClassScheme | None,
    clearance: ClearanceSettings | None,
    rejects: Rejects | None,
) -> dict[str, Any]:
    """All that decides on the results of a survey besides its files, as JSON holds it."""
    return {
        "models": [fingerprint(path) for path in paths_of(models)],
        "scheme": None if scheme is None else scheme.name,
        "clearance": None if clearance is None else clearance.model_dump(mode="json"),
        "rejects": [] if rejects is None else [fingerprint(path) for path in rejects.files],
        "settings": settings.model_dump(mode="json"),
        "detection": detection.model_dump(mode="json"),
        "crs": None if survey.crs is None else survey.crs.srs,
        "code": code,
    }


def write_layers(prediction: SurveyPrediction, geopackage: Path) -> None:
    """Write the layers of the GeoPackage."""
    line, crs, sizes = prediction.line, prediction.crs, prediction.unit_sizes
    clearances = prediction.clearances

    def more(path: Path) -> list[str]:
        names = [] if line is None else write_line_layers(path, line, crs, sizes)
        if clearances is not None:
            names += write_clearance_layers(path, clearances, crs, sizes)
        return names

    write_geopackage(
        geopackage,
        prediction.towers if prediction.finds_towers else None,
        prediction.geneos,
        crs,
        sizes,
        prediction.spool,
        prediction.files,
        prediction.target_names,
        more,
    )


def summarise(prediction: SurveyPrediction, outputs: dict[str, str]) -> PredictionSummary:
    """The summary of a prediction with the files ``outputs``; ``seconds`` counts up to now."""
    further: dict[str, Any] = {"detection": prediction.detection.model_dump()}
    if prediction.clearances is not None:
        further["clearance"] = (prediction.clearance or ClearanceSettings()).model_dump()
    crs = prediction.crs
    return PredictionSummary(
        survey=str(prediction.survey.given),
        model=prediction.card.name,
        points=prediction.n_points,
        towers=len(prediction.towers) if prediction.finds_towers else None,
        tau=prediction.card.threshold(),
        voxel_size_m=prediction.voxel_size,
        kernel_size=list(prediction.model.kernel_size),
        tiles=prediction.n_tiles,
        crs=None if crs is None else crs.to_string(),
        unit_sizes_m=list(prediction.unit_sizes),
        units=list(prediction.unit_names),
        warnings=[
            *prediction.notes,
            *(text for file in prediction.files for text in file.warnings),
        ],
        files=[file.to_json(prediction.target_names) for file in prediction.files],
        seconds=time.perf_counter() - prediction.started,
        settings=prediction.settings.model_dump() | further,
        model_provenance=prediction.card.provenance,
        outputs=outputs,
        targets=_targets(prediction),
        line=None if prediction.line is None else _line(prediction.line, prediction.clearances),
    )


def _line(line: SurveyLine, clearances: SurveyClearances | None) -> dict[str, Any]:
    """What ``PredictionSummary.line`` says."""
    kinds = [conductor.kind for conductor in line.conductors]
    return {
        "lines": len({span.line for span in line.spans if span.line}),
        "spans": sum(span.line > 0 for span in line.spans),
        "conductors": kinds.count("conductor"),
        "earth_wires": kinds.count("earth wire"),
        "cables": kinds.count("cable"),
        "rejected": len(line.rejected),
        "to_look_at": len(line.notes),
        "positions": AS_FLOWN,
        "clearances": None if clearances is None else clearances.counts(),
    }


def _targets(prediction: SurveyPrediction) -> list[dict[str, Any]]:
    """What ``PredictionSummary.targets`` says about each model."""
    first = prediction.card, prediction.model, prediction.voxel_size
    others = ((f.used.card, f.used.model, f.used.voxel_size) for f in prediction.further)
    facts = []
    for card, model, voxel_size in (first, *others):
        target = card.finds
        points = sum(
            file.tower_points if target.is_tower else file.target_points.get(target.name, 0)
            for file in prediction.files
        )
        facts.append(
            {
                "target": card.target,
                "model": card.name,
                "tau": card.threshold(),
                "voxel_size_m": voxel_size,
                "kernel_size": list(model.at(voxel_size).kernel_size),
                "points": points,
            }
        )
    return facts
