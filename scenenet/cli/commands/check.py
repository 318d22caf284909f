"""``scenenet check``."""

from __future__ import annotations

import json
import sys
from typing import Annotated

import typer

from scenenet.cli.options import AsJson, Codes, Surveys
from scenenet.core.errors import InputError

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
    as_json: AsJson = False,
) -> None:
    """Report what surveys contain and what is wrong with them.

    The report has the format, the CRS, the extent in m, the points per class and their density,
    and a warning for each fault.

    The exit code is 1 if a survey cannot be read; the other surveys are still checked.
    """
    from scenenet.pointcloud.quality.check import check_survey

    reports, errors = [], []
    for survey in surveys:
        try:
            reports.append(check_survey(survey, None if codes is None else codes.value))
        except InputError as error:
            errors.append(error)
    if as_json:
        print(json.dumps([report.to_json() for report in reports], indent=2))
    else:
        print("\n\n".join(report.text() for report in reports))
    for message in errors:
        print(f"error: {message}", file=sys.stderr)
    if errors:
        raise typer.Exit(1)
