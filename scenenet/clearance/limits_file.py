"""Limits by voltage from a file (CSV)."""

from __future__ import annotations

import csv
from pathlib import Path

from pydantic import ValidationError

from scenenet.clearance.settings import ClearanceLimits
from scenenet.core.errors import InputError

COLUMNS = tuple(ClearanceLimits.model_fields)
"""Columns of the file; the last one, ``source``, may be left out."""

REMEDY = f"Give a CSV file with the columns {', '.join(COLUMNS)}, in kV and m"


def read_limits(path: Path) -> tuple[ClearanceLimits, ...]:
    """The rows of a table of limits, by voltage.

    Raises:
        InputError: the file cannot be read, lacks a column, or a value is no limit.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            table = csv.DictReader(stream)
            names = tuple(table.fieldnames or ())
            rows = [(table.line_num, dict(row)) for row in table]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"cannot be read: {error}", file=path, remedy=REMEDY) from None
    missing = [name for name in COLUMNS[:-1] if name not in names]
    if missing:
        raise InputError(f"has no column {', '.join(missing)}", file=path, remedy=REMEDY)
    if unknown := [name for name in names if name not in COLUMNS]:
        raise InputError(f"has an unknown column {unknown[0]!r}", file=path, remedy=REMEDY)
    found: dict[float, ClearanceLimits] = {}
    for line, row in rows:
        given = {"source": str(path.name)} | {k: v for k, v in row.items() if v not in (None, "")}
        try:
            limits = ClearanceLimits.model_validate(given)
        except ValidationError as error:
            fault = error.errors()[0]
            name = ".".join(map(str, fault["loc"]))
            raise InputError(
                f"{name}: {fault['msg'].lower()}", file=path, place=f"line {line}", remedy=REMEDY
            ) from None
        if limits.voltage in found:
            raise InputError(
                f"{limits.voltage:g} kV is there twice", file=path, place=f"line {line}",
                remedy="Keep one row for each voltage",
            )  # fmt: skip
        found[limits.voltage] = limits
    if not found:
        raise InputError("has no row", file=path, remedy=REMEDY)
    return tuple(found[voltage] for voltage in sorted(found))
