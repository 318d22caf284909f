"""The spans and conductors of a survey as files: CSV, and layers of the GeoPackage."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.core.columns import FieldColumn, in_units
from scenenet.line.records import (
    CONDUCTOR_COLUMNS,
    NOTE_COLUMNS,
    SPAN_COLUMNS,
    SurveyLine,
)
from scenenet.prediction.tower_lists import arrays, write_layer

if TYPE_CHECKING:
    import pyproj

NOTES = "line_notes"
"""Name of the layer with the places to look at."""

DRAWN_M = 5.0
"""m, steps along a conductor at which a layer has its vertices. The chord of a wire with c = 300 m
is 1 cm above it there."""


def write_spans_csv(path: str | Path, line: SurveyLine, sizes: tuple[float, float, float]) -> None:
    """Write a row per span.

    Args:
        sizes: sizes in m of the units of x, y and z of the survey, in which the rows are.
    """
    write_table(path, line.spans, SPAN_COLUMNS, sizes)


def write_conductors_csv(
    path: str | Path, line: SurveyLine, sizes: tuple[float, float, float]
) -> None:
    """Write a row per conductor; arguments as ``write_spans_csv``."""
    write_table(path, line.conductors, CONDUCTOR_COLUMNS, sizes)


def write_line_layers(
    path: str | Path,
    line: SurveyLine,
    crs: pyproj.CRS | None,
    sizes: tuple[float, float, float],
) -> list[str]:
    """Add the layers ``spans`` (LineString), ``conductors`` (LineStringZ, along the wire) and
    ``line_notes`` (Point: places to look at) to a GeoPackage; returns their names.

    Args:
        sizes: as ``write_spans_csv``.
    """
    import shapely

    planar, _, vertical = sizes
    spans = [shapely.LineString(np.array([s.start, s.end]) / planar) for s in line.spans]
    wires = []
    for conductor in line.conductors:
        curve = conductor.catenary
        shares = np.linspace(0, 1, 2 + int(curve.length / DRAWN_M))
        xyz = curve.at_shares(shares) / (planar, planar, vertical)
        wires.append(shapely.LineString(xyz))
    places = [shapely.Point(note.x / planar, note.y / planar) for note in line.notes]
    layers: list[tuple[str, str, list[Any], Sequence[Any], Sequence[FieldColumn]]] = [
        ("spans", "LineString", spans, line.spans, SPAN_COLUMNS),
        ("conductors", "LineString Z", wires, line.conductors, CONDUCTOR_COLUMNS),
        (NOTES, "Point", places, line.notes, NOTE_COLUMNS),
    ]
    for name, kind, geometry, rows, columns in layers:
        write_rows(path, name, kind, geometry, rows, columns, crs, sizes)
    return [name for name, *_ in layers]


def write_rows(
    path: str | Path,
    name: str,
    kind: str,
    geometry: Sequence[Any],
    rows: Sequence[Any],
    columns: Sequence[FieldColumn],
    crs: pyproj.CRS | None,
    sizes: tuple[float, float, float],
) -> None:
    """Add a layer to a GeoPackage with a feature for each row.

    Args:
        name: of the layer.
        kind: geometry type of OGR.
        geometry: shapely geometries of the rows, in the units of the survey.
        rows: dataclasses with ``columns``, m.
        sizes: as ``write_spans_csv``.
    """
    written = [in_units(row, sizes) for row in rows]
    values = {c.name: [c.value(row) for row in written] for c in columns}
    types = {c.name: c.type for c in columns}
    write_layer(path, name, kind, geometry, arrays(values, types), crs)


def write_table(
    path: str | Path,
    rows: Sequence[Any],
    columns: Sequence[FieldColumn],
    sizes: tuple[float, float, float],
) -> None:
    """Write a row of ``columns`` for each of ``rows`` (dataclasses, m) as CSV; the other arguments
    are as those of ``write_spans_csv``."""
    with Path(path).open("w", encoding="utf-8", newline="") as stream:
        table = csv.DictWriter(stream, [c.name for c in columns], lineterminator="\n")
        table.writeheader()
        for row in rows:
            sized = in_units(row, sizes)
            table.writerow({c.name: _shown(c.value(sized)) for c in columns})


def _shown(value: Any) -> Any:
    """Lengths to a tenth of a millimetre."""
    return round(value, 4) if isinstance(value, float) else value
