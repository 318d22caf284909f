"""The surveys of a run: the survey sheet, the inbox and the folder of TS40K samples."""

from __future__ import annotations

import difflib
import errno
import glob
import os
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, cast, get_args

from pydantic import Field

from scenenet.core.errors import InputError
from scenenet.core.settings import NAME, Settings, path_fault
from scenenet.pointcloud.class_schemes import SCHEMES, Codes
from scenenet.prediction.tile_index import INDEX_SUFFIXES

if TYPE_CHECKING:
    from scenenet.config.schema import Config

Role = Literal["train", "observe", "new"]
Origin = Literal["file", "tiles", "synthetic", "ts40k"]


LAS_SUFFIXES = (".las", ".laz")
SURVEY_SUFFIXES = (*LAS_SUFFIXES, ".npy", ".pt")
LONGEST_SHOWN = 80
"""Characters of a faulty path in a message."""
RESULTS = "{results_dir}"
"""Placeholder for the result folder in a path of the sheet."""

REPEATED = re.compile(r"(.+)\1{19}$")
"""Names that Snakemake takes for an endless recursion (``PeriodicWildcardError``)."""
REPEATS = "ends in 20 or more repetitions, which Snakemake refuses"

TS40K = "ts40k"
"""Name of the survey made of the folder of TS40K samples."""


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


@dataclass(frozen=True)
class Survey:
    """A survey that the workflow works on.

    Attributes:
        name: unique; names its files.
        path: relative to the root of the project, or absolute.
        codes: class scheme of its labels.
        role: train, observe or new.
        origin: ``file`` for a recorded survey, ``tiles`` for one of many files, ``synthetic`` for
            one that the workflow makes, ``ts40k`` for a folder of samples.
        crs: the coordinate system if the file states none, as text; None if it is not known.
    """

    name: str
    path: str
    codes: Codes
    role: Role
    origin: Origin = "file"
    crs: str | None = None


def read_surveys(
    config: Config, root: str | Path = ".", warn: Callable[[str], None] | None = None
) -> list[Survey]:
    """The surveys of the sheet, the TS40K folder and the inbox, in this order.

    A file of the inbox that the workflow cannot use stops no other; it is left out.

    Args:
        config: the configuration.
        root: folder that paths are relative to.
        warn: gets a sentence for each file that is left out; None prints it on stderr.

    Raises:
        InputError: something is wrong; all problems of the sheet are listed together, with the
            numbers of their lines.
    """
    root = Path(root)
    surveys = [] if config.surveys is None else _read_sheet(config, root)
    surveys += _ts40k(config, root)
    surveys += _inbox(config, root, surveys, warn or (lambda text: print(text, file=sys.stderr)))
    names: dict[str, Survey] = {}
    for survey in surveys:
        if survey.name in names:
            raise InputError(
                f"two surveys are called {survey.name!r}: {names[survey.name].path} and "
                f"{survey.path}",
                remedy="Rename one of them",
            )
        names[survey.name] = survey
    return surveys


def _read_sheet(config: Config, root: Path) -> list[Survey]:
    file = config.surveys or ""
    try:
        lines = (root / file).read_text(encoding="utf-8-sig").splitlines()
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
    (_, header), *rows = numbered
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
    """The survey of a row, or None if a cell is missing or is no path, and the problems of the
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
        str(Path(config.results_dir, "synthetic", f"{survey.name}{config.synthetic.suffix}"))
        for survey in config.synthetic.surveys
    }
    synthetic = path in made
    problems += [] if synthetic else _path_problems(path, row["path"], role, root, config)
    origin: Origin = "synthetic" if synthetic else "tiles" if _is_tiled(root / path) else "file"
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
    return [f"{column} {value!r} is none of {', '.join(known)}{hint}"]


def _path_problems(path: str, written: str, role: str, root: Path, config: Config) -> list[str]:
    where = root / path
    if fault := _unreachable(where):
        return [f"{path} cannot be read: {fault}"]
    if _is_tiled(where):
        return _tile_problems(path, where, role)
    if where.is_dir():
        if any(file.suffix in (".npy", ".pt") for file in where.iterdir()):
            can_only = f"{path} is a folder; samples in a folder can only be trained on"
            return [can_only] if role == "new" else []
        return [f"{path} is a folder without LAS and LAZ files, and without TS40K samples"]
    if where.is_file():
        if where.suffix.lower() in SURVEY_SUFFIXES:
            return []
        return [f"{path} is none of {', '.join(SURVEY_SUFFIXES)}"]
    if written.startswith(RESULTS) or where.parent.name == "synthetic":
        names = [survey.name for survey in config.synthetic.surveys]
        close = difflib.get_close_matches(where.stem, names, n=1)
        made = f"{RESULTS}/synthetic/{close[0]}{config.synthetic.suffix}" if close else ""
        hint = f", did you mean {made}?" if close else ""
        return [f"{path} is not there, and no entry of synthetic.surveys makes it{hint}"]
    if not where.parent.is_dir():
        return [f"{path} is not there, nor is its folder"]
    names = [file.name for file in where.parent.iterdir()]
    close = difflib.get_close_matches(where.name, names, n=1)
    hint = f", did you mean {Path(path).with_name(close[0])}?" if close else ""
    return [f"{path} is not there{hint}"]


def _is_tiled(where: Path) -> bool:
    """Whether a path is a survey of many files: a folder, a pattern or a tile index."""
    if where.is_dir():
        files = [file.suffix.lower() for file in where.iterdir()]
        return not {".npy", ".pt"} & set(files) and bool({*LAS_SUFFIXES} & set(files))
    if not os.path.lexists(where):
        return glob.has_magic(str(where))
    return where.is_file() and where.suffix.lower() in INDEX_SUFFIXES


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


def _unreachable(where: Path) -> str | None:
    """Why the system cannot reach ``where``; None if it can, or if nothing is there."""
    try:
        where.stat()
    except (FileNotFoundError, NotADirectoryError):
        if where.is_symlink():
            return f"it is a link to {where.readlink()}, which does not exist"
    except OSError as error:
        return "it is part of a loop of links" if error.errno == errno.ELOOP else error.strerror
    return None


def _ts40k(config: Config, root: Path) -> Iterator[Survey]:
    if config.ts40k_dir is None:
        return
    folder = root / config.ts40k_dir
    if not folder.is_dir() or not any(f.suffix in (".npy", ".pt") for f in folder.iterdir()):
        raise InputError(
            "there are no TS40K samples (.npy, .pt)",
            file=config.ts40k_dir,
            remedy="Name their folder, for example with --config ts40k_dir=FOLDER",
        )
    yield Survey(TS40K, config.ts40k_dir, config.ts40k_codes, "train", "ts40k")


def _inbox(
    config: Config, root: Path, known: list[Survey], warn: Callable[[str], None]
) -> Iterator[Survey]:
    """LAS and LAZ files of the inbox, and folders of them, that the sheet does not name. Hidden
    ones are skipped: copy programs write to a hidden file until they have finished."""
    if config.new_surveys.folder is None or not (root / config.new_surveys.folder).is_dir():
        return
    listed = {os.path.realpath(root / survey.path) for survey in known}
    files = [
        file
        for file in sorted((root / config.new_surveys.folder).iterdir())
        if not file.name.startswith(".")
        and (_is_tiled(file) if file.is_dir() else file.suffix.lower() in LAS_SUFFIXES)
        and os.path.realpath(file) not in listed
    ]
    owners: dict[str, list[str]] = {survey.name: [survey.path] for survey in known}
    for file in files:
        owners.setdefault(_inbox_name(file), []).append(file.name)
    for file in files:
        path, name = str(Path(config.new_surveys.folder) / file.name), _inbox_name(file)
        reason = _why_left_out(file, path, name, owners[name])
        if reason is None:
            origin: Origin = "tiles" if file.is_dir() else "file"
            yield Survey(name, path, config.new_surveys.codes, "new", origin)
        else:
            warn(f"left out: {path}: {reason}")


def _inbox_name(file: Path) -> str:
    return file_name(file.name if file.is_dir() else file.stem.removesuffix(".copc"))


def _why_left_out(file: Path, path: str, name: str, owners: list[str]) -> str | None:
    """Why a file of the inbox cannot be a survey of the workflow; None if it can.

    Args:
        path: of the file, relative to the root of the project.
        name: of its survey.
        owners: the files whose survey would be called ``name``. None of those in the inbox is used,
            as one would replace the results of the other.
    """
    if fault := _unreachable(file):
        return f"{fault}. Mend or remove it"
    if fault := path_fault(path):
        return f"the path {fault}. Rename the file"
    if REPEATED.search(name):
        return f"the name {REPEATS}. Rename the file"
    if len(owners) > 1:
        return f"two surveys would be called {name!r}: {' and '.join(owners)}. Rename one of them"
    return None


def file_name(text: str) -> str:
    """``text`` made fit for a file name: letters, digits, '_', '-' and '.'."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text).strip("_.-")[:100] or "survey"
