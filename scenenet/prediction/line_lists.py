"""The spans and conductors of a survey as files: CSV, and layers of the GeoPackage."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.line.notes import NOTE_COLUMNS
from scenenet.line.records import (
    CONDUCTOR_COLUMNS,
    SPAN_COLUMNS,
    SUPPORT_COLUMNS,
    SurveyLine,
)
from scenenet.prediction.record_files import RecordLayer, write_layers, write_table

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
    """Add the layers ``spans`` (LineString), ``conductors`` (LineStringZ, along the wire),
    ``supports`` (Point: towers as the line shows them) and ``line_notes`` (Point: places to look
    at) to a GeoPackage; returns their names.

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
    feet = [shapely.Point(support.x / planar, support.y / planar) for support in line.supports]
    places = [shapely.Point(note.x / planar, note.y / planar) for note in line.notes]
    layers = [
        RecordLayer("spans", "LineString", spans, line.spans, SPAN_COLUMNS),
        RecordLayer("conductors", "LineString Z", wires, line.conductors, CONDUCTOR_COLUMNS),
        RecordLayer("supports", "Point", feet, line.supports, SUPPORT_COLUMNS),
        RecordLayer(NOTES, "Point", places, line.notes, NOTE_COLUMNS),
    ]
    return write_layers(path, layers, crs, sizes)
