"""Finds the lines of a survey, what of them reaches into each file, and what is near them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from scenenet.clearance.settings import ClearanceSettings
from scenenet.core.files import read_json, write_json
from scenenet.detection.settings import DetectionSettings
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.prediction.found_clearances import WireVoxels, find_clearances_in_survey
from scenenet.prediction.found_line import FoundLine, Rejects, WireSearch, find_line_in_survey
from scenenet.prediction.found_towers import FoundTowers, TowerSearch
from scenenet.prediction.jobs.joined import joined_predictions, joined_work, write_near
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.work.conductor_points import columns_reached
from scenenet.prediction.work.lattice import column_of
from scenenet.prediction.work.survey_work import SurveyWork
from scenenet.prediction.work.tiling import Layer
from scenenet.prediction.work.work_file import WorkFile


def find_line_of(
    survey: SurveyFiles,
    works: Sequence[str | Path],
    predictions: Sequence[str | Path],
    wires: Sequence[str | Path],
    towers: str | Path,
    detection: DetectionSettings,
    line: str | Path,
    near: str | Path,
    rejects: Rejects | None = None,
) -> None:
    """Find the lines between the towers of a survey, and the towers that they ask for.

    Args:
        works, predictions, wires: the work file, and the predictions of the models of towers and of
            wires, of each file of the survey that is not refused, in order.
        towers: what ``find_towers_of`` found.
        line: file to write (``FoundLine``).
        near: folder to write, with a file for each file of the survey that can be used: the towers
            and conductors that reach into it. It stays the same to the byte while these do.
        rejects: conductors that people rejected; None for none.

    Raises:
        InputError: no file can be used.
    """
    joined = joined_work(survey, works)
    tiles = joined_predictions(joined, predictions)
    found = find_line_in_survey(
        _wires(joined, wires),
        TowerSearch(joined.spool, tiles, joined.system.unit_sizes, tiles.tau, detection),
        FoundTowers.from_json(read_json(towers)),
        f"{survey.name}: spans traced",
    ).reviewed(rejects, joined.system)
    write_json(line, found.to_json())
    lattice = joined.spool.lattice
    reached = [(each, columns_reached(each, lattice)) for each in found.line.conductors]

    def reaching(work: WorkFile) -> Mapping[str, Any]:
        codes = list(work.blocks.codes("voxels"))
        columns = set(map(column_of, codes))
        return {
            "structures": found.towers.structures.reaching(lattice, codes).to_json(),
            "conductors": [each.to_json() for each, there in reached if columns & there],
        }

    write_near(joined, near, reaching)


def find_clearances_of(
    survey: SurveyFiles,
    works: Sequence[str | Path],
    wires: Sequence[str | Path],
    line: str | Path,
    settings: ClearanceSettings,
    scheme: ClassScheme | None,
    out: str | Path,
) -> None:
    """Measure what is near the conductors of a survey.

    Args:
        works, wires: as ``find_line_of``.
        line: what it found.
        settings, scheme: as ``find_clearances_in_survey``; with a scheme, the work files have the
            classes of the points.
        out: file to write (``SurveyClearances``).

    Raises:
        InputError: no file can be used, or the limits have none for the voltage.
    """
    joined, found = joined_work(survey, works), FoundLine.from_json(read_json(line))
    measured = find_clearances_in_survey(
        joined.spool,
        found.line,
        found.towers.structures,
        WireVoxels(_wires(joined, wires)),
        settings,
        scheme,
        f"{survey.name}: clearances measured",
    )
    write_json(out, measured.to_json())


def _wires(joined: SurveyWork, predictions: Sequence[str | Path]) -> WireSearch:
    """What the model of wires predicts, and the voxels that it observes."""
    tiles = joined_predictions(joined, predictions)
    spool = joined.spool_at(Layer(tiles.lattice.voxel_size))
    return WireSearch(spool, tiles, tiles.tau)
