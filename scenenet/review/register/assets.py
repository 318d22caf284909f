"""The assets of a register: a table with an id and a place for each tower."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.review.places import PlaceColumns, in_survey
from scenenet.review.tables.table import Row, Table, read_table

if TYPE_CHECKING:
    import pyproj

ID_NAMES = (
    "id", "asset id", "asset", "tower id", "tower", "pole id", "pole", "mast", "pylon",
    "structure id", "structure", "number", "no", "nr", "code", "name", "ref",
)  # fmt: skip
"""Names of the column with the id of an asset; neither case, blanks nor a unit matter."""


@dataclass(frozen=True)
class Assets:
    """The assets of a register.

    Attributes:
        path: its file.
        ids: of those with a place, as in the file; the place in the file where it has no ids.
        xy: (N, 2) their places, in the system and the units of the survey.
        without_place: ids of the others.
    """

    path: Path
    ids: tuple[str, ...]
    xy: np.ndarray
    without_place: tuple[str, ...]


def read_assets(
    path: str | Path,
    survey: pyproj.CRS | None,
    *,
    x: str | None = None,
    y: str | None = None,
    id: str | None = None,
    crs: pyproj.CRS | None = None,
    layer: str | None = None,
) -> Assets:
    """The assets of a register.

    Args:
        path: CSV file, GeoPackage or Shapefile.
        survey: system of the survey, that the places are converted to; None if it is not known.
        x, y, id: columns; None for the geometry, or those with one of the usual names.
        crs: system of a file that states none; None for that of the survey.
        layer: of a GeoPackage; None for its only one.

    Raises:
        InputError: the file cannot be read or has no asset, two have one id, or a coordinate is
            wrong.
    """
    table = read_table(path, layer)
    columns = PlaceColumns.of(table, x, y, crs)
    if not table.rows:
        raise table.error("there is no asset in it")
    ids = _ids(table, id)
    rows: list[Row] = []
    places: list[tuple[float, float]] = []
    placed: list[str] = []
    without: list[str] = []
    for name, row in zip(ids, table.rows, strict=True):
        place = columns.place(row)
        if place is None:
            without.append(name)
            continue
        rows.append(row)
        places.append(place)
        placed.append(name)
    if not places:
        raise table.error("none of its assets has coordinates")
    xy = in_survey(rows, places, columns.crs, survey)
    return Assets(table.path, tuple(placed), xy, tuple(without))


def _ids(table: Table, wanted: str | None) -> Sequence[str]:
    """The id of each row.

    Raises:
        InputError: there is no column ``wanted``, or two rows have the same id.
    """
    if wanted is not None and wanted not in table.columns:
        raise table.error(f"it has no column {wanted!r}; its columns: {', '.join(table.columns)}")
    column = wanted or table.column(ID_NAMES)
    seen: dict[str, Row] = {}
    ids = []
    for row in table.rows:
        name = row.text(column) or row.place
        if name in seen:
            raise row.error(
                f"the id {name!r} of column {column!r} is also that of {seen[name].place}",
                "Correct or delete one of them, or name the column of the ids with --id",
            )
        seen[name] = row
        ids.append(name)
    return ids
