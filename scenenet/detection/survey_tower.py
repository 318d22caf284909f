"""The tower list of a survey, with the only declaration of its columns.

The CSV, GeoPackage and GeoJSON files, the tables of the report and the reference page all follow
from the fields of ``SurveyTower``. A new column needs a new field here and the code that measures
it (``scenenet.prediction.found_towers``).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenenet.core.columns import column, columns_of, in_units, written
from scenenet.core.errors import InputError
from scenenet.core.files import read_json

CONTRIBUTION = "contribution_"
"""Start of the name of a column with the contribution of a GENEO."""


@dataclass(frozen=True)
class SurveyTower:
    """A tower of the tower list. ``TOWER_COLUMNS`` says what each field is."""

    id: int = column(
        "",
        "number that follows from its place; above 0, and unique in the survey",
        heading="tower",
    )
    x: float = column("m", "easting of the axis of its body, in the CRS of the survey", heading="x")
    y: float = column("m", "northing of the same place", heading="y")
    height: float = column(
        "m", "height of its top above the ground at its axis", heading="height", vertical=True
    )
    base: float = column(
        "m", "elevation of the ground at its axis", heading="base elevation", vertical=True
    )
    width: float = column(
        "m", "width of its body at half its height, of one pole for a portal", heading="width"
    )
    conductor_directions: int = column(
        "", "number of directions in which conductors leave it", heading="conductor directions"
    )
    conductor_bearings: tuple[float, ...] = column(
        "degrees", "bearing of each of these directions, clockwise from north, the longest span "
        "first",
    )  # fmt: skip
    probability: float = column("1", "highest probability of its voxels", heading="probability")
    points: int = column("", "its own points: body, crossarms and legs", heading="points")
    edge_distance: float = column(
        "m", "distance to the edge of the data, at most 50 m",
        heading="distance from the edge of the data",
    )  # fmt: skip
    contributions: Mapping[str, float] = column(
        "1", "mean share of each GENEO in the observer over its detected voxels; positive shares "
        "support a tower, negative ones oppose it",
    )  # fmt: skip

    def to_feature(self, coordinates: Sequence[float]) -> dict[str, Any]:
        """The tower as a GeoJSON feature at ``coordinates``."""
        return {
            "type": "Feature",
            "id": self.id,
            "geometry": {"type": "Point", "coordinates": list(coordinates)},
            "properties": {c.name: _plain(c.value(self)) for c in TOWER_COLUMNS},
        }

    @classmethod
    def from_feature(cls, feature: Mapping[str, Any]) -> SurveyTower:
        """The tower that ``to_feature`` wrote.

        Raises:
            KeyError: a column is missing.
        """
        values = {c.name: feature["properties"][c.name] for c in TOWER_COLUMNS}
        values["conductor_bearings"] = tuple(values["conductor_bearings"])
        return cls(**values)

    def in_units(self, sizes: tuple[float, float, float]) -> SurveyTower:
        """The same tower in units of which x, y and z have these sizes in m."""
        return in_units(self, sizes)

    def to_row(self) -> dict[str, Any]:
        """The tower as a row of plain values, with the columns of ``row_types``: bearings as a
        text, a column for each GENEO. Lengths are rounded. The others are not: a review sorts
        towers by their probability."""
        row = {
            c.name: written(c.value(self)) if c.unit == "m" else c.value(self)
            for c in TOWER_COLUMNS
            if c.type is not Mapping
        }
        row["conductor_bearings"] = " ".join(f"{b:.1f}" for b in self.conductor_bearings)
        return row | {f"{CONTRIBUTION}{name}": share for name, share in self.contributions.items()}


TOWER_COLUMNS = columns_of(SurveyTower)
"""Every column of the tower list, in the order in which files and tables have them."""


def row_types(geneos: Iterable[str]) -> dict[str, type]:
    """Column of ``SurveyTower.to_row`` -> type of its values: ``int``, ``float`` or ``str``.

    Args:
        geneos: names of the GENEOs of the model.
    """
    plain = {c.name: str if c.type is tuple else c.type for c in TOWER_COLUMNS}
    own = {name: kind for name, kind in plain.items() if kind is not Mapping}
    return own | {f"{CONTRIBUTION}{geneo}": float for geneo in geneos}


def read_towers(path: str | Path) -> list[SurveyTower]:
    """The tower list of a survey, from the GeoJSON file that ``scenenet predict`` wrote.

    Raises:
        InputError: the file is missing or is not a tower list.
    """
    try:
        return [SurveyTower.from_feature(feature) for feature in read_json(path)["features"]]
    except OSError as error:
        raise InputError(error.strerror or "cannot be read", file=path) from None
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"not a tower list of this version ({type(error).__name__}: {error})",
            file=path,
            remedy="Predict the survey again",
        ) from None


def _plain(value: Any) -> Any:
    """The value as JSON holds it."""
    if isinstance(value, tuple):
        return list(value)
    return dict(value) if isinstance(value, Mapping) else value
