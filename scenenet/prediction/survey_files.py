"""A survey as a user names it: one file, or all files of a folder or of a pattern."""

from __future__ import annotations

import glob
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.unchanged import FileState
from scenenet.pointcloud.reading import SurveyInfo, survey_of_lengths

SUFFIXES = frozenset({".las", ".laz"})
"""Endings of the files of a folder that belong to a survey; COPC files end in ``.copc.laz``."""


@dataclass(frozen=True)
class SurveyFiles:
    """The files that are one survey.

    Attributes:
        given: what the user named.
        name: of its results.
        files: its files, sorted by name.
        tiled: whether it was named as a folder or a pattern. One bad file then stops no other.
    """

    given: Path
    name: str
    files: tuple[Path, ...]
    tiled: bool = False

    @classmethod
    def of(cls, given: str | Path) -> SurveyFiles:
        """The survey that is a file, the LAS and LAZ files of a folder, or those of a pattern.

        Whether a single file exists is not looked at.

        Raises:
            InputError: the folder or the pattern has no such file.
        """
        given = Path(given)
        if given.is_dir():
            found = [path for path in given.iterdir() if path.suffix.lower() in SUFFIXES]
            name = given.resolve().name
        elif not given.exists() and glob.has_magic(str(given)):
            matches = Path(given.anchor).glob(str(given.relative_to(given.anchor)))
            found = [path for path in matches if path.suffix.lower() in SUFFIXES]
            name = next(p for p in given.parents if not glob.has_magic(str(p))).resolve().name
        else:
            return cls(given, result_stem(given), (given,))
        if not found:
            raise InputError(
                "there is no LAS or LAZ file in it",
                file=given,
                remedy="Name a survey file, a folder of tiles, or a pattern such as 'tiles/*.laz'",
            )
        return cls(given, name, tuple(sorted(found)), tiled=True)


def result_stem(path: Path) -> str:
    """Name of the results of a file; ``.copc`` is not part of it."""
    return path.stem.removesuffix(".copc")


@dataclass(frozen=True)
class SurveyFile:
    """A file of a survey, after it was read.

    Attributes:
        path: the file.
        state: its state before it was read; a later pass must find the same. None if it could not
            be read.
        n_points: points that were read.
        extent: (x, y, x, y), lowest and highest, in its units; None without points.
        tower_points: points with a tower id, once they were written.
        warnings: what looks wrong about it, as sentences.
        error: why it could not be used; None if it could.
    """

    path: Path
    state: FileState | None = None
    n_points: int = 0
    extent: tuple[float, float, float, float] | None = None
    tower_points: int = 0
    warnings: tuple[str, ...] = ()
    error: InputError | None = None

    @property
    def status(self) -> str:
        """Whether its points were predicted."""
        return "predicted" if self.error is None else "failed"

    def to_json(self) -> dict[str, Any]:
        """What the summary has of it; also the attributes of its polygon in the GeoPackage."""
        return {
            "file": self.path.name,
            "status": self.status,
            "points": self.n_points,
            "tower_points": self.tower_points,
            "error": "" if self.error is None else str(self.error),
        }


def readable(files: Iterable[SurveyFile]) -> Iterator[tuple[SurveyFile, FileState]]:
    """The files that could be read, each with its state."""
    for file in files:
        if file.error is None and file.state is not None:
            yield file, file.state


def look_at(survey: SurveyFiles) -> tuple[dict[Path, SurveyInfo], dict[Path, InputError]]:
    """The headers of the files that can be used, and the errors of the others.

    Raises:
        InputError: no file can be used, or, of a survey that is one file, that one.
    """
    headers: dict[Path, SurveyInfo] = {}
    errors: dict[Path, InputError] = {}
    for path in survey.files:
        try:
            info = survey_of_lengths(path)
            _check_system(info, next(iter(headers.values()), info), path)
            headers[path] = info
        except InputError as error:
            if not survey.tiled:
                raise
            errors[path] = error
    if not headers:
        raise nothing_to_use(survey, list(errors.values()))
    return headers, errors


def nothing_to_use(survey: SurveyFiles, errors: Sequence[InputError]) -> InputError:
    """The error of a survey that has no file left."""
    return InputError(
        f"none of its {len(survey.files)} files can be used; the first error is: {errors[0]}",
        file=survey.given,
        remedy="Correct the files: scenenet check shows what is wrong with each",
    )


def _check_system(info: SurveyInfo, first: SurveyInfo, path: Path) -> None:
    """Refuse a file in another CRS than the first one."""
    if (info.crs, info.unit_sizes) != (first.crs, first.unit_sizes):
        ours, theirs = (i.crs.name if i.crs else "no CRS" for i in (first, info))
        raise InputError(
            f"the file has {theirs}, and the files before it have {ours}",
            file=path,
            remedy="Predict it by itself, or convert it first (pdal translate -f reprojection)",
        )
