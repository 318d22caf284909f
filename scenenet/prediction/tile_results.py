"""Writes the points of a survey of many files, and goes on where an earlier run was stopped."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError, OutputError
from scenenet.core.files import atomic, read_json, write_json
from scenenet.core.progress import quiet, track
from scenenet.core.provenance import fingerprint
from scenenet.pointcloud.copc import write_copc
from scenenet.prediction.file_status import SurveyFile
from scenenet.prediction.point_writer import write_points
from scenenet.prediction.result_files import PredictionFiles, copc_of
from scenenet.prediction.survey_prediction import SurveyPrediction
from scenenet.prediction.work.work_folder import WorkFolder


def write_tiles(
    prediction: SurveyPrediction,
    files: PredictionFiles,
    written: dict[str, str],
    work: WorkFolder,
) -> tuple[SurveyFile, ...]:
    """Write the points of each file that was read and that an earlier run has not written, and the
    fingerprint of each into ``written``."""
    before = read_json(work.written) if work.written.exists() else {}
    done: dict[str, dict[str, Any]] = {}
    read = []
    for file in track(prediction.files, f"{prediction.survey.given.name}: files written"):
        if file.error is None:
            try:
                facts = before.get(file.name)
                if facts is None or not _is_as_written(files, facts["outputs"]):
                    with quiet():
                        facts = _write_tile(file, prediction, files, written)
                done[file.name] = facts
                written |= facts["outputs"]
                write_json(files.unfinished, written)
                write_json(work.written, done)
                counts = ("towers", "tower_points", "target_points")
                file = replace(file, **{name: facts[name] for name in counts})
            except OutputError:
                raise
            except InputError as error:
                file = replace(file, error=error)
        read.append(file)
    return tuple(read)


def _write_tile(
    file: SurveyFile,
    prediction: SurveyPrediction,
    files: PredictionFiles,
    written: Mapping[str, str],
) -> dict[str, Any]:
    """Write the points of a file; the fingerprints of its outputs, and what the status says.

    A fingerprint is recorded before its file appears, so that a later run knows the file as its own
    wherever this one is stopped.
    """
    target = files.points[file.path]
    with atomic(target) as partial:
        counted = write_file(file, prediction, partial)
        outputs = {files.key(target): fingerprint(partial)}
        write_json(files.unfinished, {**written, **outputs})
    if files.copc:
        copc = copc_of(target)
        with atomic(copc) as partial:
            write_copc(target, partial)
            outputs[files.key(copc)] = fingerprint(partial)
            write_json(files.unfinished, {**written, **outputs})
    return {
        "outputs": outputs,
        "towers": counted.towers,
        "tower_points": counted.tower_points,
        "target_points": dict(counted.target_points),
    }


def _is_as_written(files: PredictionFiles, outputs: Mapping[str, str]) -> bool:
    """Whether the outputs of a file are all there, and are those with these fingerprints."""
    folder = files.summary.parent
    return all(
        (folder / key).exists() and fingerprint(folder / key) == known
        for key, known in outputs.items()
    )


def write_file(file: SurveyFile, prediction: SurveyPrediction, out: str | Path) -> SurveyFile:
    """Write every point of a file back (``write_points``)."""
    return write_points(file, prediction.points, out, prediction.settings, prediction.survey.crs)
