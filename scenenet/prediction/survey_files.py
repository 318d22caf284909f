"""A survey as a user names it: one file, or all files of a folder, a pattern or a tile index."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenenet.core.errors import InputError
from scenenet.pointcloud.reading import SurveyInfo, survey_of_lengths
from scenenet.pointcloud.units import CONVERT
from scenenet.prediction.file_status import LeftOut
from scenenet.prediction.tile_index import INDEX_SUFFIXES, SUFFIXES, read_index
from scenenet.prediction.work.survey_system import SurveySystem

if TYPE_CHECKING:
    import pyproj


@dataclass(frozen=True)
class SurveyFiles:
    """The files that are one survey.

    Attributes:
        given: what the user named.
        name: of its results.
        files: its files; those of a folder or a pattern are sorted by name.
        tiled: whether it was named as a folder, a pattern or a tile index. One bad file then stops
            no other.
        refused: the files that cannot be opened, with the reason, such as the URLs of an index.
        notes: what looks wrong about the list of files, as sentences.
        crs: the system of files that state none; None if it is not known.
    """

    given: Path
    name: str
    files: tuple[Path, ...]
    tiled: bool = False
    refused: Mapping[Path, InputError] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    crs: pyproj.CRS | None = None

    @classmethod
    def of(cls, given: str | Path, crs: pyproj.CRS | None = None) -> SurveyFiles:
        """The survey that is a file, or the LAS and LAZ files of a folder, a pattern or an index.

        Whether a single file exists is not looked at.

        Raises:
            InputError: the folder or the pattern has no such file, or the index cannot be read.
        """
        given = Path(given)
        if given.suffix.lower() in INDEX_SUFFIXES and given.is_file():
            index = read_index(given)
            files = (*index.files, *index.refused)
            return cls(given, given.stem, files, True, index.refused, index.notes, crs)
        if given.is_dir():
            found = [path for path in given.iterdir() if _is_tile(path)]
            name, nothing = given.resolve().name, "there is no LAS or LAZ file in it"
        elif not given.exists() and glob.has_magic(str(given)):
            matches = Path(given.anchor).glob(str(given.relative_to(given.anchor)))
            found = [path for path in matches if _is_tile(path)]
            name = next(p for p in given.parents if not glob.has_magic(str(p))).resolve().name
            nothing = "no LAS or LAZ file matches this pattern"
        else:
            return cls(given, result_stem(given), (given,), crs=crs)
        if not found:
            raise InputError(
                nothing,
                file=given,
                remedy="Name a survey file, a folder of tiles, a pattern such as 'tiles/*.laz', or "
                "a tile index",
            )
        return cls(given, name, tuple(sorted(found)), tiled=True, crs=crs)

    @property
    def names(self) -> Mapping[Path, str]:
        """The name of each file in the results: that of the file, or its path below the folder of
        all files if the results of two would have the same name."""
        names = {path: path.name for path in self.files}
        there = [path.absolute() for path in self.files if path not in self.refused]
        if len({result_stem(path) for path in there}) < len(there):
            base = os.path.commonpath([path.parent for path in there])
            names |= {
                path: path.absolute().relative_to(base).as_posix()
                for path in self.files
                if path not in self.refused
            }
        return names

    def to_json(self) -> dict[str, Any]:
        """All of it as plain values, for a later stage."""
        return {
            "given": str(self.given),
            "name": self.name,
            "files": [str(path) for path in self.files],
            "tiled": self.tiled,
            "refused": {str(path): error.to_json() for path, error in self.refused.items()},
            "notes": list(self.notes),
            "crs": None if self.crs is None else self.crs.srs,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> SurveyFiles:
        """The survey that ``to_json`` gave."""
        import pyproj

        return cls(
            given=Path(data["given"]),
            name=data["name"],
            files=tuple(map(Path, data["files"])),
            tiled=data["tiled"],
            refused={Path(p): InputError.from_json(e) for p, e in data["refused"].items()},
            notes=tuple(data["notes"]),
            crs=None if data["crs"] is None else pyproj.CRS(data["crs"]),
        )


def _is_tile(path: Path) -> bool:
    """Whether a file of a folder belongs to the survey. Hidden ones do not: copy programs write to
    a hidden file until they have finished."""
    return path.suffix.lower() in SUFFIXES and not path.name.startswith(".")


def result_name(name: str) -> str:
    """Name of the results of a file of a survey, from its name in the survey; it may have
    folders."""
    return Path(name).with_name(result_stem(Path(name))).as_posix()


def result_stem(path: Path) -> str:
    """Name of the results of a file; ``.copc`` is not part of it."""
    return path.stem.removesuffix(".copc")


def look_at(survey: SurveyFiles) -> tuple[dict[Path, SurveyInfo], dict[Path, InputError]]:
    """The headers of the files that can be used, and the errors of the others.

    Raises:
        InputError: no file can be used, or, of a survey that is one file, that one.
    """
    headers: dict[Path, SurveyInfo] = {}
    errors: dict[Path, InputError] = dict(survey.refused)
    for path in survey.files:
        if path in errors:
            continue
        try:
            headers[path] = survey_of_lengths(path, survey.crs)
        except InputError as error:
            if not survey.tiled:
                raise
            errors[path] = error
    systems = {path: SurveySystem.of(info) for path, info in headers.items()}
    ours = system_of_survey((systems[path], info.n_points) for path, info in headers.items())
    for path, theirs in systems.items():
        if ours is not None and not theirs.is_same(ours):
            errors[path] = in_other_system(path, theirs, ours, headers.pop(path).n_points)
    if not headers:
        raise nothing_to_use(survey, list(errors.values()))
    return headers, errors


def system_of_survey(files: Iterable[tuple[SurveySystem, int]]) -> SurveySystem | None:
    """The coordinates of a survey: those of the first of its files that has points.

    Args:
        files: coordinates and number of points of each file that can be read. Programs write no
            system into a file that they find no points for, so these count only without others.
    """
    known = list(files)
    return next((system for system, n in known if n), known[0][0] if known else None)


def nothing_to_use(survey: SurveyFiles, errors: Sequence[InputError]) -> InputError:
    """The error of a survey that has no file left."""
    return InputError(
        f"none of its {len(survey.files)} files can be used; the first error is: {errors[0]}",
        file=survey.given,
        remedy="Correct the files: scenenet check shows what is wrong with each",
    )


def in_other_system(path: Path, theirs: SurveySystem, ours: SurveySystem, n_points: int) -> LeftOut:
    """The error of a file with other coordinates than those of the survey."""
    if not n_points:  # programs write no system into a file that they find nothing for
        return LeftOut("it has no points", file=path)
    remedy = f"Predict it by itself, or convert it first {CONVERT}"
    if theirs.crs is None:
        remedy = (
            "If its coordinates are those of the other files, name the system of the survey with "
            f"--crs, such as --crs EPSG:32629. Otherwise convert it first {CONVERT}"
        )
    return LeftOut(
        f"the file has {theirs.name}, and the files before it have {ours.name}",
        file=path,
        remedy=remedy,
    )
