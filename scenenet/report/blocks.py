"""The content of the report: sections of text, facts, tables and figures, independent of HTML."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import pandas as pd

if TYPE_CHECKING:
    from scenenet.figures import Picture

NOTHING = "–"
"""Shown instead of a missing number: not measured, not published, or a spread over one seed."""

Format = Literal[
    "text",
    "sentence",
    "count",
    "score",
    "score2",
    "percent",
    "share",
    "metres",
    "seconds",
    "number",
    "plain",
    "yes",
]


@dataclass(frozen=True)
class Column:
    """One column of a table on the page.

    Attributes:
        name: column of the data frame.
        label: heading, with the unit.
        format: how its values are written.
        spread: column with the standard deviation, written after the value.
        published: whether the numbers are those of the thesis; they have another style.
    """

    name: str
    label: str
    format: Format = "text"
    spread: str | None = None
    published: bool = False

    @property
    def numeric(self) -> bool:
        return self.format not in ("text", "sentence", "yes")


@dataclass(frozen=True)
class Text:
    text: str
    kind: str = "text"


@dataclass(frozen=True)
class Link:
    """A link to another file of the run; ``address`` is from the folder of the page."""

    text: str
    address: str
    kind: str = "link"


@dataclass(frozen=True)
class Notes:
    """A list of notes, such as the warnings of a check."""

    title: str
    items: Sequence[str]
    kind: str = "notes"


@dataclass(frozen=True)
class Facts:
    """A few single numbers: (label, value) pairs."""

    items: Sequence[tuple[str, str]]
    kind: str = "facts"


@dataclass(frozen=True)
class Table:
    """A table as shown; a ``folded`` table opens on demand."""

    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[str]]
    source: str | None = None
    folded: bool = False
    kind: str = "table"


@dataclass(frozen=True)
class Figure:
    picture: Picture
    kind: str = "figure"


@dataclass(frozen=True)
class Scene:
    """An interactive crop; ``data`` is from ``scenenet.figures.interactive_crop``."""

    name: str
    title: str
    caption: str
    alt: str
    colourings: Sequence[tuple[str, str]]
    data: Mapping[str, Any]
    kind: str = "scene"


@dataclass(frozen=True)
class Heading:
    """A heading inside a section, not in the list of contents."""

    text: str
    kind: str = "heading"


Block = Text | Link | Notes | Facts | Table | Figure | Scene | Heading


@dataclass
class Section:
    """A part of the report with an entry in the list of contents."""

    id: str
    title: str
    blocks: list[Block] = field(default_factory=list)


def table(
    frame: pd.DataFrame,
    columns: Sequence[Column],
    caption: str,
    source: str | None = None,
    folded: bool = False,
) -> Table:
    """A data frame with selected columns, formatted.

    Columns without any value are left out, such as numbers that the thesis does not report.
    """
    shown = [column for column in columns if frame[column.name].notna().any()]
    rows = [[_cell(row, column) for column in shown] for row in frame.to_dict("records")]
    return Table(caption, shown, rows, source, folded)


def write(value: Any, how: Format) -> str:
    """A value as text."""
    if value is None or (isinstance(value, float) and math.isnan(value)) or str(value) == "<NA>":
        return NOTHING
    return _WRITERS[how](value)


def _cell(row: Mapping[Any, Any], column: Column) -> str:
    value = row[column.name]
    text = write(value, column.format)
    deviation = row[column.spread] if column.spread else None
    spread = write(deviation, column.format)
    if NOTHING in (text, spread):
        return text
    if column.format == "number":
        # With the decimals of its value.
        spread = f"{deviation:.{0 if abs(value) >= 100 else 2}f}"
    return f"{text} ± {spread}"


def _decimals(value: float) -> int:
    """Number of decimals: 2; 0 from 100 on and for whole numbers."""
    return 0 if abs(value) >= 100 or value == round(value) else 2


def _seconds(value: float) -> str:
    if value >= 3600:
        return f"{value / 3600:.1f} h"
    if value >= 120:
        return f"{value / 60:.1f} min"
    return f"{value:.1f} s" if value >= 1 else f"{1000 * value:.3g} ms"


_WRITERS: Mapping[str, Callable[[Any], str]] = {
    "text": str,
    "sentence": str,
    # A narrow space between thousands (SI), which cannot be taken for a decimal sign.
    "count": lambda value: f"{round(value):,}".replace(",", "\u202f"),
    "score": lambda value: f"{value:.3f}",
    "score2": lambda value: f"{value:.2f}",
    "percent": lambda value: f"{value:.3f}" if value else "0",
    "share": lambda value: f"{value:.1f}",
    "metres": lambda value: f"{value:.2f}",
    "seconds": _seconds,
    "number": lambda value: f"{value:.{_decimals(value)}f}",
    "plain": lambda value: f"{value:.10g}",
    "yes": lambda value: "yes" if str(value).lower() in ("true", "1") else "no",
}
