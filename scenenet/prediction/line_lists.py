"""The spans and conductors of a survey as files: CSV, and layers of the GeoPackage."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.line.catenary import Catenary
from scenenet.line.notes import NOTE_COLUMNS
from scenenet.line.records import (
    CONDUCTOR_COLUMNS,
    SPAN_COLUMNS,
    SUPPORT_COLUMNS,
    Conductor,
    SurveyLine,
)
from scenenet.prediction.record_files import RecordLayer, write_layers, write_table

if TYPE_CHECKING:
    import pyproj

NOTES = "line_notes"
"""Name of the layer with the places to look at."""

CONDUCTORS, REJECTED = "conductors", "rejected_conductors"
"""Names of the layers with the conductors, and with those that people rejected."""

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
    ``supports`` (Point: towers as the line shows them), ``line_notes`` (Point: places to look at)
    and, if people rejected conductors, ``rejected_conductors`` to a GeoPackage; returns their
    names.

    Args:
        sizes: as ``write_spans_csv``.
    """
    import shapely

    planar, _, vertical = sizes
    spans = [shapely.LineString(np.array([s.start, s.end]) / planar) for s in line.spans]

    def along(conductors: Sequence[Conductor]) -> list[Any]:
        scale = planar, planar, vertical
        return [shapely.LineString(drawn(each.catenary) / scale) for each in conductors]

    feet = [shapely.Point(support.x / planar, support.y / planar) for support in line.supports]
    places = [shapely.Point(note.x / planar, note.y / planar) for note in line.notes]
    layers = [
        RecordLayer("spans", "LineString", spans, line.spans, SPAN_COLUMNS),
        _conductors(CONDUCTORS, along(line.conductors), line.conductors),
        RecordLayer("supports", "Point", feet, line.supports, SUPPORT_COLUMNS),
        RecordLayer(NOTES, "Point", places, line.notes, NOTE_COLUMNS),
    ]
    if line.rejected:
        layers.append(_conductors(REJECTED, along(line.rejected), line.rejected))
    return write_layers(path, layers, crs, sizes)


def _conductors(name: str, along: Sequence[Any], conductors: Sequence[Conductor]) -> RecordLayer:
    return RecordLayer(name, "LineString Z", along, conductors, CONDUCTOR_COLUMNS)


def drawn(curve: Catenary) -> np.ndarray:
    """(n, 3) m, the vertices with which a layer draws a wire."""
    return curve.at_shares(np.linspace(0, 1, 2 + int(curve.length / DRAWN_M)))
