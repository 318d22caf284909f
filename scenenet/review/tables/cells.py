"""Values in the cells of a table, as spreadsheets of different countries write them."""

from __future__ import annotations

import math
import re

SPACES = re.compile(r"[\s\u00a0\u202f']")
"""What separates thousands beside points and commas."""


def text_of(cell: object) -> str:
    """The cell as text without outer blanks; empty for an empty cell."""
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    if isinstance(cell, float) and cell.is_integer():  # a GeoPackage may hold ids as real numbers
        return str(int(cell))
    return str(cell).strip()


def number_of(cell: object) -> float | None:
    """The cell as a number; None for an empty one.

    Of a text with both signs, the last of point and comma separates the decimals. A sign that
    occurs twice separates thousands; one that occurs once separates the decimals.

    Raises:
        ValueError: it is no finite number.
    """
    if isinstance(cell, int | float) and not isinstance(cell, bool):
        number = float(cell)
        if math.isnan(number):
            return None
    else:
        text = SPACES.sub("", text_of(cell))
        if not text:
            return None
        point, comma = text.rfind("."), text.rfind(",")
        decimal = "," if comma > point else "."
        if text.count(decimal) > 1:
            decimal = ""
        text = text.replace("," if decimal == "." else ".", "")
        text = text.replace(",", "." if decimal == "," else "")
        number = float(text) if re.fullmatch(r"[+-]?[\d.]+(?:[eE][+-]?\d+)?", text) else math.nan
    if not math.isfinite(number):
        raise ValueError(f"{cell!r} is no number")
    return number


def whole_number_of(cell: object) -> int | None:
    """The cell as a whole number; None for an empty one.

    Raises:
        ValueError: it is no whole number.
    """
    number = number_of(cell)
    if number is None:
        return None
    if not number.is_integer():
        raise ValueError(f"{cell!r} is no whole number")
    return int(number)
