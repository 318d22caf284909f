"""What became of each file of a survey: in the summary, the layer ``tiles`` and ``status.csv``."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.unchanged import FileState
from scenenet.pointcloud.targets import TOWER


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
        target_points: points taken for each other target, by its name, once they were written.
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
    target_points: Mapping[str, int] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    error: InputError | None = None

    @property
    def status(self) -> str:
        """Whether its points were predicted, and if not, whether the file is at fault."""
        if isinstance(self.error, LeftOut):
            return "left out"
        return "predicted" if self.error is None else "failed"

    def to_json(self, targets: Sequence[str] = (TOWER.name,)) -> dict[str, Any]:
        """What all results say about it.

        Args:
            targets: names of what was looked for.
        """
        counts: dict[str, int] = {}
        if TOWER.name in targets:
            counts |= {"towers": self.towers, "tower_points": self.tower_points}
        others = (name for name in targets if name != TOWER.name)
        counts |= {f"{name}_points": self.target_points.get(name, 0) for name in others}
        return {
            "file": self.name,
            "status": self.status,
            "points": self.n_points,
            **counts,
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
            "target_points": dict(self.target_points),
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
            target_points=data["target_points"],
            warnings=tuple(data["warnings"]),
            error=error,
        )


def readable(files: Iterable[SurveyFile]) -> Iterator[tuple[SurveyFile, FileState]]:
    """The files that could be read, each with its state."""
    for file in files:
        if file.error is None and file.state is not None:
            yield file, file.state


def write_status(
    path: str | Path, files: Sequence[SurveyFile], targets: Sequence[str] = (TOWER.name,)
) -> None:
    """Write a row per file of a survey as CSV; ``targets`` are the names of what was looked for."""
    rows = [file.to_json(targets) for file in files]
    with Path(path).open("w", encoding="utf-8", newline="") as stream:
        table = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
