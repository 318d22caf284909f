"""Merges the review files of a survey in one call, for the workflow."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from scenenet.review.decisions import read_decisions, refuse
from scenenet.review.found_list import find_list
from scenenet.review.merge import merge
from scenenet.review.reviewed_files import ReviewedFiles, write_review


def review_survey(towers: str | Path, decisions: Sequence[str | Path], folder: str | Path) -> None:
    """Write the reviewed list of a survey.

    Args:
        towers: tower list of a prediction.
        decisions: review files.
        folder: folder to write the files of ``ReviewedFiles`` to.

    Raises:
        InputError: a file cannot be read, or rows cannot be used; all of them are named.
        OutputError: a file cannot be written.
    """
    found, paths = find_list(towers), list(map(Path, decisions))
    review, errors = merge(found, read_decisions(paths, found))
    for text in (*review.unmatched, *review.warnings):
        print(f"warning: {text}", file=sys.stderr)
    refuse(errors)
    write_review(review, found, paths, ReviewedFiles.of(found, Path(folder), None))
