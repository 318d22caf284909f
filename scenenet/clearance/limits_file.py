"""Limits by voltage from a file (CSV)."""

from __future__ import annotations

from pathlib import Path

from scenenet.clearance.settings import ClearanceLimits
from scenenet.clearance.settings_table import read_rows
from scenenet.core.errors import InputError


def read_limits(path: Path) -> tuple[ClearanceLimits, ...]:
    """The rows of a table of limits, by voltage.

    Raises:
        InputError: the file cannot be read, lacks a column, or a value is not a limit.
    """
    found: dict[float, ClearanceLimits] = {}
    for place, limits in read_rows(path, ClearanceLimits, "kV and m"):
        if limits.voltage in found:
            raise InputError(
                f"{limits.voltage:g} kV is there twice", file=path, place=place,
                remedy="Keep one row for each voltage",
            )  # fmt: skip
        found[limits.voltage] = limits
    return tuple(found[voltage] for voltage in sorted(found))
