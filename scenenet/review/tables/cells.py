"""Values in the cells of a table, as spreadsheets of different countries write them."""

from __future__ import annotations

import math
import re

EXPONENT = r"(?:[eE][+-]?\d+)?"
PLAIN = re.compile(rf"[+-]?(?:\d+[.,]?\d*|[.,]\d+){EXPONENT}")
GROUPED = (
    re.compile(rf"[+-]?\d{{1,3}}(?P<sign>[,'’\s])\d{{3}}(?:(?P=sign)\d{{3}})*(?:\.\d*)?{EXPONENT}"),
    re.compile(rf"[+-]?\d{{1,3}}(?P<sign>[.'’\s])\d{{3}}(?:(?P=sign)\d{{3}})*(?:,\d*)?{EXPONENT}"),
)
"""Numbers with separators of thousands, with a decimal point and with a decimal comma."""


def text_of(cell: object) -> str:
    """The cell as text without outer blanks; empty for an empty cell."""
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    if isinstance(cell, float) and cell.is_integer():  # a GeoPackage may hold ids as real numbers
        return str(int(cell))
    return str(cell).strip()


def number_of(cell: object) -> float | None:
    """The cell as a number; None for an empty one.

    A single point or comma separates the decimals. Separators of thousands stand before groups of
    three digits, and the other one of the two separates the decimals then.

    Raises:
        ValueError: it is not a finite number.
    """
    if isinstance(cell, int | float) and not isinstance(cell, bool):
        number = float(cell)
        if math.isnan(number):
            return None
    else:
        text = text_of(cell)
        if not text:
            return None
        number = _parsed(text)
    if not math.isfinite(number):
        raise ValueError(f"{cell!r} is not a number")
    return number


def _parsed(text: str) -> float:
    """The number in a text; NaN if it is none."""
    if PLAIN.fullmatch(text):
        return float(text.replace(",", "."))
    for pattern, decimal in zip(GROUPED, ".,", strict=True):
        if pattern.fullmatch(text):
            kept = "".join(sign for sign in text if sign in f"0123456789+-eE{decimal}")
            return float(kept.replace(",", "."))
    return math.nan


def whole_number_of(cell: object) -> int | None:
    """The cell as a whole number; None for an empty one.

    Raises:
        ValueError: it is not a whole number.
    """
    number = number_of(cell)
    if number is None:
        return None
    if not number.is_integer():
        raise ValueError(f"{cell!r} is not a whole number")
    return int(number)
