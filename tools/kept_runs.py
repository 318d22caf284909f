"""The runs that README and docs quote: their result files under ``docs/results``, one folder each.

``docs/figures.yaml`` declares the runs; its model is ``Figures``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from functools import cache
from io import StringIO
from pathlib import Path
from typing import Any

import pandas as pd
import yaml
from pydantic import Field, ValidationError

from scenenet.core.code_hash import code_hash
from scenenet.core.errors import InputError
from scenenet.core.files import read_json, write_json, write_text
from scenenet.core.settings import Settings
from scenenet.experiments.components.summary import summarise_components

FIGURES = "docs/figures.yaml"
KEPT = "docs/results"
PUBLISHED = "config/thesis.yaml"
MADE_BY = ("stage", "version", "code", "config")
"""What is kept of ``provenance.json``."""
SUMMARIES = {"components": summarise_components}
"""Stem of a kept file -> what makes its table, where the file has a row per run."""

Place = tuple[str, str, str]
"""Where a number stands. ``RUN/FILE``, the first cells of the row, the column; or ``thesis``, a
published number of ``config/thesis.yaml``, and its key there."""


class Run(Settings):
    """A run that pages quote."""

    title: str
    command: str = Field(description="what makes the results, in the project folder")
    results: str = Field(description="folder that the command writes")
    files: dict[str, str] = Field(
        description="kept file -> files of the results; those of a pattern become one table"
    )


class Sentence(Settings):
    """A sentence with figures: ``{}`` with two decimals, ``{:n}`` at most one, ``{:%}`` in %."""

    text: str
    values: list[Place]


class Figures(Settings):
    """Where the figures of README and docs come from."""

    runs: dict[str, Run]
    sources: dict[str, str] = Field(description="sources of answers, in the order of the tables")
    sentences: dict[str, list[Sentence]] = Field(description="of each page")
    kinds: dict[str, str] = Field(description="pattern of numbers that are not measurements -> why")
    no_measurement: dict[str, dict[str, str]] = Field(description="page -> phrase -> why")
    not_covered: dict[str, str] = Field(description="page that is not checked -> why")


def read_figures(root: Path) -> Figures:
    """``docs/figures.yaml`` of the project in ``root``.

    Raises:
        InputError: it does not fit ``Figures``.
    """
    path = root / FIGURES
    try:
        return Figures(**yaml.safe_load(path.read_text(encoding="utf-8")))
    except ValidationError as error:
        first = error.errors()[0]
        place = " / ".join(map(str, first["loc"]))
        raise InputError(first["msg"], file=FIGURES, place=place) from None


class Values:
    """The numbers of the kept runs and of the thesis."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def rows(self, run: str, stem: str) -> list[dict[str, Any]]:
        """The table of a kept file, a row per case.

        Raises:
            InputError: it is not there.
        """
        return _rows(stem, self.text(run, f"{stem}.csv"))

    def text(self, run: str, file: str) -> str:
        """A kept file.

        Raises:
            InputError: it is not there.
        """
        return _kept(self.root, run, file)

    def __getitem__(self, place: Place) -> float:
        file, row, column = place
        if file == "thesis":
            numbers = _published((self.root / PUBLISHED).read_text(encoding="utf-8"))
            return float(numbers[row][column])
        cells = row.split(", ")
        rows = self.rows(*file.split("/"))
        found = [one for one in rows if [str(cell) for cell in one.values()][: len(cells)] == cells]
        if len(found) != 1 or pd.isna(found[0].get(column)):
            raise InputError(
                f"{len(found)} rows begin with {row!r} and a number in {column!r}, not one",
                file=f"{KEPT}/{file}.csv",
                remedy=f"Correct the place in {FIGURES}, or the sentence that quotes it",
            )
        return float(found[0][column])


@cache
def _rows(stem: str, text: str) -> list[dict[str, Any]]:
    table = pd.read_csv(StringIO(text))
    if stem in SUMMARIES:
        table = SUMMARIES[stem](table)
    return [{str(k): v for k, v in row.items()} for row in table.to_dict("records")]


@cache
def _published(text: str) -> dict[str, dict[str, Any]]:
    numbers: dict[str, dict[str, Any]] = yaml.safe_load(text)["numbers"]
    return numbers


def keeping(name: str) -> str:
    """The command that keeps a run."""
    return f"python tools/doc_figures.py --keep {name}"


def keep(root: Path, name: str, run: Run, results: Path) -> list[str]:
    """Copy the files of a run to ``docs/results``, with what made them in ``run.json``.

    Returns:
        the files of the results that were found.
    """
    folder, sources = root / KEPT / name, []
    for kept, pattern in run.files.items():
        found = sorted(results.glob(pattern))
        if not found:
            raise InputError("no such file", file=results / pattern, remedy=f"Run: {run.command}")
        write_text(folder / kept, _joined(found))
        sources += [{"file": str(p.relative_to(results)), **_made_by(p)} for p in found]
    record = {"title": run.title, "command": run.command, "files": sources}
    write_json(folder / "run.json", record)
    return [source["file"] for source in sources]


def outlived(root: Path, run: Run, name: str) -> Iterator[str]:
    """The kept files that differ from those of the last run, where there is one."""
    for kept, pattern in run.files.items():
        found = sorted((root / run.results).glob(pattern))
        path = root / KEPT / name / kept
        if found and _joined(found) != path.read_text(encoding="utf-8"):
            yield f"{KEPT}/{name}/{kept}"


def kept_command(root: Path, name: str) -> str:
    """The command that made a kept run."""
    return str(_record(root, name)["command"])


def made_on(root: Path, name: str) -> str:
    """The days on which the files of a kept run were made, and whether by one code."""
    files = _record(root, name)["files"]
    days = {file["date"] for file in files}
    text = " to ".join(sorted({min(days), max(days)}))
    same = len({file.get("code") for file in files}) == 1
    return text if same else f"{text}, by different versions of the code,"


def older(root: Path, name: str) -> list[str]:
    """The files of a kept run that were made by other code than today's, where it was recorded."""
    files = [file for file in _record(root, name)["files"] if "code" in file]
    codes = {file["stage"]: "" for file in files}
    for stage in codes:
        codes[stage] = code_hash([root / "workflow" / "scripts" / f"{stage}.py"])
    return [file["file"] for file in files if file["code"] != codes[file["stage"]]]


def _record(root: Path, name: str) -> dict[str, Any]:
    record: dict[str, Any] = json.loads(_kept(root, name, "run.json"))
    return record


def _kept(root: Path, name: str, file: str) -> str:
    path = root / KEPT / name / file
    if not path.is_file():
        raise InputError("no such run is kept", file=path, remedy=f"Keep it: {keeping(name)}")
    return path.read_text(encoding="utf-8")


def _joined(files: list[Path]) -> str:
    """Files as one. CSV files must have the same columns; of a JSON file the single values become a
    row, with the name of the file first."""
    if files[0].suffix == ".json":
        rows = [
            {"file": path.name.partition(".")[0], **dict(_flat(read_json(path)))} for path in files
        ]
        return pd.DataFrame(rows).to_csv(index=False, float_format="%.6g")
    head, *_ = texts = [path.read_text(encoding="utf-8") for path in files]
    columns = head.partition("\n")[0]
    for path, text in zip(files, texts, strict=True):
        if len(files) > 1 and text.partition("\n")[0] != columns:
            raise InputError(f"the columns are not those of {files[0]}", file=path)
    return head + "".join(text.partition("\n")[2] for text in texts[1:])


def _flat(data: Mapping[str, Any], start: str = "") -> Iterator[tuple[str, Any]]:
    """Key and value of each single value; the keys on the way to it are joined by dots."""
    for key, value in data.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{start}{key}.")
        elif not isinstance(value, list):
            yield f"{start}{key}", value


def _made_by(path: Path) -> dict[str, str]:
    """Day, and the fingerprints of code and settings where the workflow recorded them."""
    day = datetime.fromtimestamp(path.stat().st_mtime, UTC).date().isoformat()
    record = path.with_name("provenance.json")
    known = json.loads(record.read_text(encoding="utf-8")) if record.is_file() else {}
    return {"date": day} | {k: known[k] for k in MADE_BY if k in known}
