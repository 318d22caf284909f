"""The conductors that review files reject, for a prediction that leaves them out."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Set
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenenet.line.records import SurveyLine
from scenenet.prediction.line_lists import drawn
from scenenet.prediction.work.survey_system import SurveySystem
from scenenet.review.conductors import merge_conductors
from scenenet.review.decisions import read_rows, refuse
from scenenet.review.listed_conductor import ListedConductor


@dataclass(frozen=True)
class RejectedConductors:
    """The conductors that review files reject, for a prediction (``Rejects``).

    Attributes:
        files: the review files.
    """

    files: tuple[Path, ...]

    @classmethod
    def of(cls, files: Iterable[str | Path]) -> RejectedConductors | None:
        """Those of review files; None without a file."""
        paths = tuple(map(Path, files))
        return cls(paths) if paths else None

    def check(self) -> None:
        """Look at the files before a survey is predicted.

        Raises:
            InputError: one cannot be read, or rows cannot be used; all of them are named.
        """
        refuse(read_rows(self.files).errors)

    def __call__(self, line: SurveyLine, system: SurveySystem) -> Set[tuple[int, int]]:
        """The numbers of the conductors; stderr names them, and the rows that match none."""
        scale = np.array(system.unit_sizes)
        listed = [
            ListedConductor(each.span_id, each.conductor_id, drawn(each.catenary) / scale)
            for each in line.conductors
        ]
        statements = read_rows(self.files).in_survey(system.crs)
        review, errors = merge_conductors(listed, statements, system.unit_sizes)
        # A survey took hours to get here, so a row that says nothing clear does not stop it.
        faults = (*statements.errors, *errors)
        for text in (*review.unmatched, *(f"no decision is taken: {each}" for each in faults)):
            print(f"warning: {text}", file=sys.stderr)
        gone = review.decided("rejected")
        if gone:
            print(f"rejected, and left out: {review.rejected()}", file=sys.stderr)
        return {each.listed.key for each in gone}
