"""Coordinates in a table: which columns have them, and what they are in the survey."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.las.crs import same_system
from scenenet.review.tables.table import Row, Table

if TYPE_CHECKING:
    import pyproj

X_NAMES = ("x", "easting", "east", "x coord", "coord x", "utm x", "e")
Y_NAMES = ("y", "northing", "north", "y coord", "coord y", "utm y", "n")
LONGITUDE_NAMES = ("lon", "longitude", "long", "lng")
LATITUDE_NAMES = ("lat", "latitude")
"""Names of the columns with coordinates; neither case, blanks nor a unit in brackets matter."""

DEGREES = 4326
"""EPSG code of longitude and latitude, where a table states no other system for them."""


class NoPlaces(InputError):
    """A table has no coordinates; arguments as ``InputError``."""


@dataclass(frozen=True)
class PlaceColumns:
    """Where a table has its coordinates.

    Attributes:
        x, y: the columns; None for the geometry.
        crs: system of the coordinates; None for that of the survey.
    """

    x: str | None
    y: str | None
    crs: pyproj.CRS | None

    @classmethod
    def of(
        cls,
        table: Table,
        x: str | None = None,
        y: str | None = None,
        crs: pyproj.CRS | None = None,
    ) -> PlaceColumns:
        """The coordinates of a table: the columns named, else the geometry, else columns with one
        of the usual names.

        Args:
            x, y: columns that the user names.
            crs: system that the user names; needed where the file states none, and not the survey's
                is meant.

        Raises:
            NoPlaces: there are no coordinates.
            InputError: there is no column ``x`` or ``y``, or the file states another system than
                ``crs``.
        """
        import pyproj

        for name in (x, y):
            if name is not None and name not in table.columns:
                raise table.error(
                    f"it has no column {name!r}; its columns: {', '.join(table.columns)}"
                )
        if x is None and y is None and table.has_points:
            if crs is not None and table.crs is not None and not same_system(crs, table.crs):
                raise table.error(
                    f"the file states {table.crs.name}, and the system given for it is {crs.name}",
                    "Give none for this file",
                )
            return cls(None, None, table.crs or crs)
        if x is not None and y is not None:
            return cls(x, y, crs)
        found = x or table.column(X_NAMES), y or table.column(Y_NAMES)
        if None not in found:
            return cls(*found, crs)
        found = table.column(LONGITUDE_NAMES), table.column(LATITUDE_NAMES)
        if None not in found:
            return cls(*found, crs or pyproj.CRS(DEGREES))
        raise NoPlaces(
            f"no columns with coordinates among {', '.join(table.columns)}",
            file=table.path,
            remedy=f"Call them {X_NAMES[0]} and {Y_NAMES[0]}, or {LONGITUDE_NAMES[0]} and "
            f"{LATITUDE_NAMES[0]}, or name them with --x and --y",
        )

    def place(self, row: Row) -> tuple[float, float] | None:
        """The coordinates in a row; None where it has none.

        Raises:
            InputError: only one is there, or one is not a number.
        """
        if self.x is None:
            return row.point
        x, y = row.number(self.x), row.number(self.y)
        if x is None and y is None:
            return None
        if x is None or y is None:
            missing = self.x if x is None else self.y
            raise row.error(f"it has no {missing}", "Give both coordinates, or none")
        return x, y


def in_survey(
    rows: Sequence[Row],
    places: Sequence[tuple[float, float]],
    crs: pyproj.CRS | None,
    survey: pyproj.CRS | None,
) -> np.ndarray:
    """Places in the system of a survey, (N, 2).

    Args:
        rows: where they come from.
        places: in their own system.
        crs: that system; None for the survey's own.
        survey: system of the survey; None if it is not known.

    Raises:
        InputError: the system of the survey is not known and the places are in another one, or a
            place cannot be in its system.
    """
    xy = np.array(places, float).reshape(-1, 2)
    if crs is None or len(xy) == 0:
        return xy
    file = rows[0].file
    if survey is None:
        raise InputError(
            f"its coordinates are in {crs.name}, and the system of the survey is not known",
            file=file,
            remedy="Predict the survey again with --crs, or give the coordinates of the survey",
        )
    plain = survey.to_2d()
    if same_system(crs.to_2d(), plain):
        return xy
    if crs.is_geographic:
        wrong = (np.abs(xy) > [180.0, 90.0]).any(axis=1)
        _refuse(rows, xy, wrong, "it is not a longitude and latitude in degrees")
    moved = np.column_stack(_conversion(crs.to_2d(), plain).transform(*xy.T))
    _refuse(rows, xy, ~np.isfinite(moved).all(axis=1), f"it is outside of {plain.name}")
    return moved


@cache
def _conversion(crs: pyproj.CRS, survey: pyproj.CRS) -> pyproj.Transformer:
    from pyproj import Transformer

    return Transformer.from_crs(crs, survey, always_xy=True)


def _refuse(rows: Sequence[Row], xy: np.ndarray, wrong: np.ndarray, problem: str) -> None:
    if wrong.any():
        number = int(np.argmax(wrong))
        x, y = xy[number].tolist()
        raise rows[number].error(
            f"{problem}: {x:.12g}, {y:.12g}", "Check the order of the columns, and --crs"
        )
