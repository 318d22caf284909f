"""``scenenet check``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenenet.cli.inputs import Failures
from scenenet.cli.options import AsJson, Codes, Surveys, System, coordinate_system

if TYPE_CHECKING:
    from scenenet.prediction.survey_files import SurveyFiles

EXAMPLES = (
    "scenenet check line.laz",
    "scenenet check surveys/*.laz --codes edp --json > report.json",
)


def command(
    surveys: Surveys,
    codes: Annotated[
        Codes | None,
        typer.Option(help="Class scheme, to name the classes. Without it, only codes are shown."),
    ] = None,
    crs: System = None,
    as_json: AsJson = False,
) -> None:
    """Report what surveys contain and what is wrong with them.

    The report has the format, the CRS, the extent in m, the points per class and their density,
    and a warning for each fault.

    A folder of LAS and LAZ files, a pattern such as 'tiles/*.laz' in quotes and a tile index (.vpc,
    STAC .json, .gpkg) give a report on each file.

    The exit code is 1 if a file cannot be read, or if its coordinates are no lengths, such as
    degrees; the others are still checked.
    """
    from scenenet.core.errors import warn
    from scenenet.pointcloud.quality.check import check_survey, raise_if_no_lengths

    system = coordinate_system(crs)
    scheme = None if codes is None else codes.value
    failures = Failures()
    reports, texts = [], []
    for survey in failures.look_at(surveys, _files).values():
        warn(survey.given, survey.notes)
        failures.errors += survey.refused.values()
        for path in survey.files:
            if path not in survey.refused:
                with failures.collect():
                    reports.append(check_survey(path, scheme, crs=system))
                    texts.append(reports[-1].text(path))
                    raise_if_no_lengths(path, reports[-1], system)
    if as_json:
        print(json.dumps([report.to_json() for report in reports], indent=2))
    elif texts:
        print("\n\n".join(texts))
    failures.end()


def _files(given: Path) -> SurveyFiles:
    """The files of a survey; a folder of TS40K samples is checked as one."""
    from scenenet.pointcloud.ts40k import SAMPLE_SUFFIXES
    from scenenet.prediction.survey_files import SurveyFiles

    if given.is_dir() and any(path.suffix in SAMPLE_SUFFIXES for path in given.iterdir()):
        return SurveyFiles(given, given.name, (given,))
    return SurveyFiles.of(given)
