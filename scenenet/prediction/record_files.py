"""Rows of a dataclass with columns (``scenenet.core.columns``) as files: CSV, and layers of a
GeoPackage."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from scenenet.core.columns import FieldColumn, in_units, written
from scenenet.prediction.tower_lists import arrays, write_layer

if TYPE_CHECKING:
    import pyproj


class RecordLayer(NamedTuple):
    """A layer with a feature for each row.

    Attributes:
        name: of the layer.
        kind: geometry type of OGR, such as ``LineString Z``.
        geometry: shapely geometries of the rows, in the units of the survey.
        rows: dataclasses with ``columns``, m.
        columns: of the layer.
    """

    name: str
    kind: str
    geometry: Sequence[Any]
    rows: Sequence[Any]
    columns: Sequence[FieldColumn]


def write_layers(
    path: str | Path,
    layers: Iterable[RecordLayer],
    crs: pyproj.CRS | None,
    sizes: tuple[float, float, float],
) -> list[str]:
    """Add layers to a GeoPackage; returns their names.

    Args:
        crs: of the survey; None if it is not known.
        sizes: sizes in m of the units of x, y and z of the survey, in which the rows are written.
    """
    names = []
    for layer in layers:
        written = [in_units(row, sizes) for row in layer.rows]
        values = {c.name: [c.value(row) for row in written] for c in layer.columns}
        types = {c.name: c.type for c in layer.columns}
        write_layer(path, layer.name, layer.kind, layer.geometry, arrays(values, types), crs)
        names.append(layer.name)
    return names


def write_table(
    path: str | Path,
    rows: Sequence[Any],
    columns: Sequence[FieldColumn],
    sizes: tuple[float, float, float],
) -> None:
    """Write a row of ``columns`` for each of ``rows`` (dataclasses, m) as CSV; with lengths
    in units of which x, y and z have ``sizes`` in m."""
    with Path(path).open("w", encoding="utf-8", newline="") as stream:
        table = csv.DictWriter(stream, [c.name for c in columns], lineterminator="\n")
        table.writeheader()
        for row in rows:
            sized = in_units(row, sizes)
            table.writerow({c.name: written(c.value(sized)) for c in columns})
