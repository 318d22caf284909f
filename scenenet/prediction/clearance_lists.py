"""The clearances of a survey as files: CSV by span, and layers of the GeoPackage."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.clearance.records import (
    CLEARANCE_COLUMNS,
    PROFILE_COLUMNS,
    SPAN_CLEARANCE_COLUMNS,
    TREE_COLUMNS,
    SurveyClearances,
)
from scenenet.prediction.record_files import RecordLayer, write_layers, write_table

if TYPE_CHECKING:
    import pyproj


def write_clearances_csv(
    path: str | Path, clearances: SurveyClearances, sizes: tuple[float, float, float]
) -> None:
    """Write a row per span, the worst first.

    Args:
        sizes: sizes in m of the units of x, y and z of the survey, in which the rows are.
    """
    write_table(path, clearances.spans, SPAN_CLEARANCE_COLUMNS, sizes)


def write_clearance_layers(
    path: str | Path,
    clearances: SurveyClearances,
    crs: pyproj.CRS | None,
    sizes: tuple[float, float, float],
) -> list[str]:
    """Add layers to a GeoPackage; returns their names.

    They are ``clearances`` (LineStringZ, from the conductor to what is near) and ``fall_trees``
    (PointZ, the foot of the tree), the worst first, and ``clearance_profile`` (PointZ, what is
    nearest in a step along a span), span by span.

    Args:
        sizes: as ``write_clearances_csv``.
    """
    import shapely

    planar, _, vertical = sizes
    scale = np.array([planar, planar, vertical])
    apart = [
        shapely.LineString(np.array([(p.wire_x, p.wire_y, p.wire_z), (p.x, p.y, p.z)]) / scale)
        for p in clearances.places
    ]
    feet = [shapely.Point(np.array([t.x, t.y, t.ground]) / scale) for t in clearances.trees]
    steps = [shapely.Point(np.array([s.x, s.y, s.z]) / scale) for s in clearances.profile]
    layers = [
        RecordLayer("clearances", "LineString Z", apart, clearances.places, CLEARANCE_COLUMNS),
        RecordLayer("fall_trees", "Point Z", feet, clearances.trees, TREE_COLUMNS),
        RecordLayer("clearance_profile", "Point Z", steps, clearances.profile, PROFILE_COLUMNS),
    ]
    return write_layers(path, layers, crs, sizes)
