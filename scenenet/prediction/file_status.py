"""What became of each file of a survey: in the summary, the layer ``tiles`` and ``status.csv``."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.unchanged import FileState


class LeftOut(InputError):
    """A file that can be read, but does not belong to the survey; arguments as ``InputError``."""


@dataclass(frozen=True)
class SurveyFile:
    """A file of a survey, after it was read.

    Attributes:
        path: the file.
        name: its name in the survey (``SurveyFiles.names``).
        state: its state before it was read; a later pass must find the same. None if it could not
            be read.
        n_points: points that were read.
        extent: (x, y, x, y), lowest and highest, in its units; None without points.
        towers: towers with a point in it, once the points were written. A tower at a seam counts in
            each of its files.
        tower_points: points with a tower id, once they were written.
        warnings: what looks wrong about it, as sentences.
        error: why it could not be used; None if it could.
    """

    path: Path
    name: str
    state: FileState | None = None
    n_points: int = 0
    extent: tuple[float, float, float, float] | None = None
    towers: int = 0
    tower_points: int = 0
    warnings: tuple[str, ...] = ()
    error: InputError | None = None

    @property
    def status(self) -> str:
        """Whether its points were predicted, and if not, whether the file is at fault."""
        if isinstance(self.error, LeftOut):
            return "left out"
        return "predicted" if self.error is None else "failed"

    def to_json(self) -> dict[str, Any]:
        """What all results say about it."""
        return {
            "file": self.name,
            "status": self.status,
            "points": self.n_points,
            "towers": self.towers,
            "tower_points": self.tower_points,
            "error": "" if self.error is None else str(self.error),
        }

    def to_record(self) -> dict[str, Any]:
        """All of it as plain values, for a later stage."""
        error = self.error
        return {
            "path": str(self.path),
            "name": self.name,
            "state": None if self.state is None else self.state.to_json(),
            "n_points": self.n_points,
            "extent": self.extent,
            "towers": self.towers,
            "tower_points": self.tower_points,
            "warnings": self.warnings,
            "error": None if error is None else error.to_json(),
            "left_out": isinstance(error, LeftOut),
        }

    @classmethod
    def from_record(cls, data: Mapping[str, Any]) -> SurveyFile:
        """What ``to_record`` gave."""
        error = None
        if data["error"] is not None:
            error = (LeftOut if data["left_out"] else InputError).from_json(data["error"])
        return cls(
            path=Path(data["path"]),
            name=data["name"],
            state=None if data["state"] is None else FileState.from_json(data["state"]),
            n_points=data["n_points"],
            extent=None if data["extent"] is None else tuple(data["extent"]),
            towers=data["towers"],
            tower_points=data["tower_points"],
            warnings=tuple(data["warnings"]),
            error=error,
        )


def readable(files: Iterable[SurveyFile]) -> Iterator[tuple[SurveyFile, FileState]]:
    """The files that could be read, each with its state."""
    for file in files:
        if file.error is None and file.state is not None:
            yield file, file.state


def write_status(path: str | Path, files: Sequence[SurveyFile]) -> None:
    """Write a row per file of a survey as CSV."""
    rows = [file.to_json() for file in files]
    with Path(path).open("w", encoding="utf-8", newline="") as stream:
        table = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
