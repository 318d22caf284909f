"""The survey sheet, a text file with a row for each survey."""

from __future__ import annotations

import difflib
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, cast, get_args

from pydantic import Field

from scenenet.config.survey import (
    LAS_SUFFIXES,
    REPEATED,
    REPEATS,
    SAMPLE_SUFFIXES,
    Origin,
    Role,
    Survey,
    file_name,
    is_tiled,
    unreachable,
)
from scenenet.core.errors import InputError
from scenenet.core.settings import NAME, Settings, path_fault
from scenenet.pointcloud.class_schemes import SCHEMES, Codes

if TYPE_CHECKING:
    from scenenet.config.schema import Config

SURVEY_SUFFIXES = (*LAS_SUFFIXES, *SAMPLE_SUFFIXES)
LONGEST_SHOWN = 80
"""Characters of a faulty path in a message."""
RESULTS = "{results_dir}"
"""Placeholder for the result folder in a path of the sheet."""


class SurveyRow(Settings):
    """A row of the survey sheet, a text file with tabs between the columns."""

    survey: str = Field(
        pattern=NAME, max_length=100, description="name of the survey, used in file names"
    )
    path: str = Field(
        min_length=1,
        description="LAS, LAZ, COPC, .npy or .pt file; for train and observe also a folder of "
        "TS40K samples; for new also a folder, a pattern or a tile index of LAS and LAZ files, "
        "which are one survey; relative to the root of the project, or absolute; "
        f"{RESULTS}/synthetic/NAME.laz is a synthetic survey, .las where they are temporary",
    )
    codes: Codes = Field(description="class scheme of the labels")
    role: Role = Field(
        description="train: part of the dataset; observe: only observers are trained on it; new: "
        "only classified"
    )
    crs: str = Field(
        "",
        description="coordinate system of a new survey whose file states none, such as "
        "EPSG:32629; the column may be missing",
    )


COLUMNS = tuple(SurveyRow.model_fields)
NEEDED = tuple(name for name, field in SurveyRow.model_fields.items() if field.is_required())


def read_sheet(config: Config, root: Path) -> list[Survey]:
    """The surveys of the sheet, in its order.

    Raises:
        InputError: as ``scenenet.config.read_surveys.read_surveys``.
    """
    file = config.surveys or ""
    (_, header), *rows = _cells(root / file, file)
    _check_header(header, file)
    surveys: list[Survey] = []
    problems: list[str] = []
    first: dict[tuple[str, str], int] = {}
    for number, cells in rows:
        survey, found = _read_row(dict(zip(header, cells, strict=False)), config, root)
        if len(cells) > len(header):
            found.insert(0, f"{len(cells)} columns, where the first line names {len(header)}")
        if survey is not None:
            resolved = os.path.realpath(root / survey.path)
            for what, key in (
                (f"the name {survey.name!r}", ("name", survey.name)),
                (f"the file {survey.path} with this role", (survey.role, resolved)),
            ):
                earlier = first.setdefault(key, number)
                if earlier != number:
                    found.append(f"{what} is on line {earlier} already")
            surveys.append(survey)
        problems += [f"  line {number}: {problem}" for problem in found]
    if problems:
        count = "one problem" if len(problems) == 1 else f"{len(problems)} problems"
        raise InputError("\n".join([f"{count} in the survey sheet", *problems]), file=file)
    return surveys


def _cells(path: Path, file: str) -> list[tuple[int, list[str]]]:
    """The number and the cells of each line that is neither empty nor a comment, the header
    first."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise InputError(
            f"the survey sheet cannot be read ({error.strerror})",
            file=file,
            remedy="Name it in the configuration as surveys, or set surveys to null",
        ) from None
    except UnicodeDecodeError as error:
        raise InputError(
            "the survey sheet is not UTF-8 text", file=file, place=str(error)
        ) from None
    numbered = [
        (number, [cell.strip() for cell in line.split("\t")])
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not numbered:
        raise InputError(
            "the survey sheet is empty",
            file=file,
            remedy=f"Its first line names the columns: {', '.join(COLUMNS)}, with tabs between",
        )
    return numbered


def _check_header(header: list[str], file: str) -> None:
    if len(header) == 1 and re.search(r"[,;]|\s{2,}", header[0]):
        raise InputError(
            "the columns of the survey sheet must be separated by tabs",
            file=file,
            place="line 1",
        )
    unknown = [name for name in header if name not in COLUMNS]
    missing = [name for name in NEEDED if name not in header]
    problems = [f"column {name!r} is missing" for name in missing]
    others = [name for name in COLUMNS if name not in header]
    problems += [
        f"column {name!r} is not known"
        + "".join(
            f", did you mean {near!r}?" for near in difflib.get_close_matches(name, others, 1)
        )
        for name in unknown
    ]
    problems += [f"column {n!r} is there twice" for n in COLUMNS if header.count(n) > 1]
    if problems:
        raise InputError(
            "; ".join(problems),
            file=file,
            place="line 1",
            remedy=f"The columns are: {', '.join(COLUMNS)}",
        )


def _read_row(row: dict[str, str], config: Config, root: Path) -> tuple[Survey | None, list[str]]:
    """The survey of a row, or None if a cell is missing or is not a path, and the problems of the
    row."""
    problems = [f"{name} is empty" for name in NEEDED if not row.get(name)]
    if problems:
        return None, problems
    name, codes, role = row["survey"], row["codes"], row["role"]
    path = row["path"].replace(RESULTS, config.results_dir)
    if fault := path_fault(path):
        shown = path if len(path) <= LONGEST_SHOWN else f"{path[:LONGEST_SHOWN]}..."
        problems.append(f"the path {shown!r} {fault}")
    if not re.match(NAME, name) or len(name) > 100:
        problems.append(
            f"survey {name!r} cannot be the name of a file: use letters, digits, '_', '-' and '.', "
            f"such as {file_name(name)!r}"
        )
    if REPEATED.search(name):
        problems.append(f"survey {name!r} {REPEATS}")
    problems += _unknown("codes", codes, tuple(SCHEMES))
    problems += _unknown("role", role, get_args(Role))
    problems += _system_problems(row.get("crs", ""), role)
    if fault:
        return None, problems
    path = str(Path(path).expanduser())
    made = {
        str(Path(config.results_dir, "synthetic", f"{survey.name}.laz"))
        for survey in config.synthetic.surveys
    }
    synthetic = path in made
    problems += [] if synthetic else _path_problems(path, row["path"], role, root, config)
    origin: Origin = "synthetic" if synthetic else "tiles" if is_tiled(root / path) else "file"
    # An unknown code or role is among the problems, and then the survey is not used.
    crs = row.get("crs") or None
    return Survey(name, path, cast(Codes, codes), cast(Role, role), origin, crs), problems


def _system_problems(text: str, role: str) -> list[str]:
    if not text:
        return []
    if role != "new":
        return ["crs is only for the role new; a training survey keeps the system of its file"]
    from scenenet.pointcloud.las.crs import named_system

    try:
        named_system(text)
    except InputError as error:
        return [f"crs {error}"]
    return []


def _unknown(column: str, value: str, known: tuple[str, ...]) -> list[str]:
    if value in known:
        return []
    close = difflib.get_close_matches(value.lower(), known, n=1)
    hint = f", did you mean {close[0]!r}?" if close else ""
    return [f"{column} {value!r} is not one of {', '.join(known)}{hint}"]


def _path_problems(path: str, written: str, role: str, root: Path, config: Config) -> list[str]:
    where = root / path
    if fault := unreachable(where):
        return [f"{path} cannot be read: {fault}"]
    if is_tiled(where):
        return _tile_problems(path, where, role)
    if where.is_dir():
        if any(file.suffix in SAMPLE_SUFFIXES for file in where.iterdir()):
            can_only = f"{path} is a folder; samples in a folder can only be trained on"
            return [can_only] if role == "new" else []
        return [f"{path} is a folder without LAS and LAZ files, and without TS40K samples"]
    if where.is_file():
        if where.suffix.lower() in SURVEY_SUFFIXES:
            return []
        return [f"{path} is not one of {', '.join(SURVEY_SUFFIXES)}"]
    if written.startswith(RESULTS) or where.parent.name == "synthetic":
        names = [survey.name for survey in config.synthetic.surveys]
        close = difflib.get_close_matches(where.stem, names, n=1)
        made = f"{RESULTS}/synthetic/{close[0]}.laz" if close else ""
        hint = f", did you mean {made}?" if close else ""
        return [f"{path} is not there, and no entry of synthetic.surveys makes it{hint}"]
    if not where.parent.is_dir():
        return [f"{path} is not there, nor is its folder"]
    names = [file.name for file in where.parent.iterdir()]
    close = difflib.get_close_matches(where.name, names, n=1)
    hint = f", did you mean {Path(path).with_name(close[0])}?" if close else ""
    return [f"{path} is not there{hint}"]


def _tile_problems(path: str, where: Path, role: str) -> list[str]:
    if role != "new":
        return [
            f"{path} is a survey of many LAS and LAZ files, which can only be classified (role "
            "new); to train on them, give each file a row"
        ]
    from scenenet.prediction.survey_files import SurveyFiles

    try:
        SurveyFiles.of(where)
    except InputError as error:
        return [f"{path}: {error.problem}"]
    return []
