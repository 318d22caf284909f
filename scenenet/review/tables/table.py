"""A table with named columns, whichever file it comes from."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scenenet.core.errors import InputError
from scenenet.review.tables.cells import number_of, text_of, whole_number_of

if TYPE_CHECKING:
    import pyproj

UNIT = re.compile(r"[\[(].*?[\])]")
"""A unit in the heading of a column, such as ``x [m]``."""


@dataclass(frozen=True)
class Row:
    """A row of a table.

    Attributes:
        file: its file.
        place: where it is in the file, such as ``row 7``, as a spreadsheet counts.
        cells: column -> its value; None or an empty text where there is none.
        point: x and y of its geometry; None in a file without geometry, or where it is empty.
    """

    file: Path
    place: str
    cells: Mapping[str, object]
    point: tuple[float, float] | None = None

    def text(self, column: str | None) -> str:
        """The text in a column; empty where the table has no such column."""
        return "" if column is None else text_of(self.cells.get(column))

    def number(self, column: str | None) -> float | None:
        """The number in a column; None where the cell is empty or the table has no such column.

        Raises:
            InputError: it is not a number.
        """
        try:
            return None if column is None else number_of(self.cells.get(column))
        except ValueError:
            raise self.error(
                f"{self.text(column)!r} in column {column!r} is not a number",
                "Correct it, or leave the cell empty",
            ) from None

    def whole_number(self, column: str | None) -> int | None:
        """The whole number in a column; as ``number``.

        Raises:
            InputError: it is not a whole number.
        """
        try:
            return None if column is None else whole_number_of(self.cells.get(column))
        except ValueError:
            raise self.error(
                f"{self.text(column)!r} in column {column!r} is not a whole number",
                "Correct it, or leave the cell empty",
            ) from None

    def error(self, problem: str, remedy: str) -> InputError:
        """The error of this row."""
        return InputError(problem, file=self.file, place=self.place, remedy=remedy)


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        path: its file.
        columns: their names, as in the file.
        rows: of the table, without those that are empty.
        has_points: whether the file has a geometry for each row.
        crs: of the geometry; None if the file states none.
    """

    path: Path
    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    has_points: bool = False
    crs: pyproj.CRS | None = None

    def column(self, names: Sequence[str]) -> str | None:
        """The first of ``names`` that is a column; neither case, blanks nor a unit matter."""
        known = {plain_name(column): column for column in reversed(self.columns)}
        return next((known[name] for name in map(plain_name, names) if name in known), None)

    def error(self, problem: str, remedy: str | None = None) -> InputError:
        """An error of the whole table."""
        return InputError(problem, file=self.path, remedy=remedy)


def plain_name(column: str) -> str:
    """The name of a column without case, unit and separators."""
    return re.sub(r"[\s_\-.]+", "", UNIT.sub("", column)).lower()


def read_table(path: str | Path, layer: str | None = None) -> Table:
    """The table in a file.

    Args:
        path: ``.csv``, ``.txt`` or ``.tsv``; ``.gpkg`` or ``.shp``.
        layer: of a GeoPackage; None for its only one.

    Raises:
        InputError: the file cannot be read, or is not a table.
    """
    from scenenet.review.tables.csv_file import read_csv
    from scenenet.review.tables.layer import read_layer

    path = Path(path)
    if not path.is_file():
        reason = "this is a folder, not a table" if path.is_dir() else "there is no such file"
        raise InputError(reason, file=path)
    suffix = path.suffix.lower()
    if suffix in (".csv", ".txt", ".tsv"):
        return read_csv(path)
    if suffix in (".gpkg", ".shp"):
        return read_layer(path, layer)
    raise InputError(
        "a table is a .csv, .gpkg or .shp file",
        file=path,
        remedy="Save it as CSV, or export the layer as GeoPackage",
    )
