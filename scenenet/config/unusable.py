"""New surveys that cannot be predicted, from their headers."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping

from scenenet.config.survey import LAS_SUFFIXES, Survey
from scenenet.core.errors import InputError
from scenenet.pointcloud.las.crs import named_system
from scenenet.pointcloud.reading import survey_of_lengths


def unusable_surveys(surveys: Iterable[Survey]) -> dict[str, str]:
    """New surveys of one file that the header shows to be no use -> why.

    Their own jobs fail, and no other needs them. A survey of many files is looked at file by file
    (``scenenet.config.tile_plan``).
    """
    found = {}
    for survey in surveys:
        recorded = survey.role == "new" and survey.origin == "file"
        if recorded and survey.path.lower().endswith(LAS_SUFFIXES):
            try:
                crs = None if survey.crs is None else named_system(survey.crs)
                survey_of_lengths(survey.path, crs)
            except InputError as error:
                found[survey.name] = str(error)
    return found


def print_failed(failed: Mapping[str, str], surveys: int, results: str) -> None:
    """Say on stderr which new surveys failed.

    Args:
        failed: name -> why.
        surveys: number of all new surveys.
        results: folder of the results.
    """
    reasons = "".join(f"\n  {reason}" for reason in failed.values())
    print(
        f"{len(failed)} of {surveys} new surveys failed:{reasons}\n"
        f"What follows from the others is in {results}/predict/. Remove or repair these files and "
        "run the workflow again.",
        file=sys.stderr,
    )
