"""Rows of settings from a table that a user writes (CSV)."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from scenenet.core.errors import InputError
from scenenet.core.settings import Settings

Row = TypeVar("Row", bound=Settings)


def columns_of_table(kind: type[Settings]) -> str:
    """The columns of a table of such rows, for messages and help."""
    return ", ".join(kind.model_fields)


def read_rows(path: Path, kind: type[Row], units: str) -> Iterator[tuple[str, Row]]:
    """The rows of a table, each with its place in the file (``line 2``). The columns are the fields
    of the rows; those with a default may be left out.

    Args:
        kind: what a row is. Its field ``source`` is the name of the file where the row has none.
        units: of the columns, for messages.

    Raises:
        InputError: the file cannot be read, lacks a column, has an unknown one or no row, or a
            value is not possible.
    """
    remedy = f"Give a CSV file with the columns {columns_of_table(kind)}, in {units}"
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            table = csv.DictReader(stream)
            names = tuple(table.fieldnames or ())
            rows = [(f"line {table.line_num}", dict(row)) for row in table]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"cannot be read: {error}", file=path, remedy=remedy) from None
    needed = [name for name, field in kind.model_fields.items() if field.is_required()]
    missing = [name for name in needed if name not in names]
    if missing:
        raise InputError(f"has no column {', '.join(missing)}", file=path, remedy=remedy)
    if unknown := [name for name in names if name not in kind.model_fields]:
        raise InputError(f"has an unknown column {unknown[0]!r}", file=path, remedy=remedy)
    if not rows:
        raise InputError("has no row", file=path, remedy=remedy)
    for place, row in rows:
        given = {"source": path.name} | {k: v for k, v in row.items() if v not in (None, "")}
        try:
            yield place, kind.model_validate(given)
        except ValidationError as error:
            fault = error.errors()[0]
            name = ".".join(map(str, fault["loc"]))
            raise InputError(
                f"{name}: {fault['msg'].lower()}", file=path, place=place, remedy=remedy
            ) from None
