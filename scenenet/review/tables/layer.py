"""Layers of GeoPackages and Shapefiles as tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.review.tables.table import Row, Table

if TYPE_CHECKING:
    import pyproj


def layers_of(path: Path) -> list[str]:
    """Names of the layers of a file.

    Raises:
        InputError: GDAL cannot read the file.
    """
    import pyogrio

    try:
        return [str(name) for name, _ in pyogrio.list_layers(path)]
    except pyogrio.errors.DataSourceError as error:
        raise InputError(f"the file cannot be read ({error})", file=path) from None


def read_layer(path: Path, layer: str | None = None) -> Table:
    """A layer of points, or a table without geometry.

    Args:
        layer: None for the only one.

    Raises:
        InputError: the file cannot be read, has no such layer, or a feature is not a point.
    """
    import pyogrio
    import shapely

    name = _layer(path, layer)
    try:
        facts, ids, geometry, values = pyogrio.raw.read(path, layer=name, return_fids=True)
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError) as error:
        raise InputError(f"the layer cannot be read ({error})", file=path, place=name) from None
    columns = [str(column) for column in facts["fields"]]
    shapes = [None] * len(ids) if geometry is None else list(shapely.from_wkb(geometry))
    rows = []
    for number, (feature, shape) in enumerate(zip(ids, shapes, strict=True)):
        cells = {
            column: _plain(value[number]) for column, value in zip(columns, values, strict=True)
        }
        place = f"feature {feature}"
        rows.append(Row(path, place, cells, _point(shape, path, place)))
    crs = None if geometry is None else _crs(facts["crs"])
    return Table(path, tuple(columns), tuple(rows), geometry is not None, crs)


def _layer(path: Path, wanted: str | None) -> str:
    there = layers_of(path)
    if wanted is not None and wanted in there:
        return wanted
    # The table from which QGIS takes its styles is not data.
    data = [name for name in there if name != "layer_styles"]
    if wanted is None and len(data) == 1:
        return data[0]
    listed = ", ".join(data) or "none"
    if wanted is None:
        raise InputError(
            f"it has several layers: {listed}" if data else "it has no layer",
            file=path,
            remedy="Name one with --layer" if data else None,
        )
    raise InputError(f"it has no layer {wanted!r}; its layers: {listed}", file=path)


def _plain(value: Any) -> object:
    """The value as Python has it."""
    if isinstance(value, np.datetime64):
        return None if np.isnat(value) else str(value)
    return value.item() if isinstance(value, np.generic) else value


def _point(shape: Any, path: Path, place: str) -> tuple[float, float] | None:
    import shapely

    if shape is None or shape.is_empty:
        return None
    if shape.geom_type == "MultiPoint" and len(shape.geoms) == 1:
        [shape] = shape.geoms
    if shape.geom_type != "Point":
        raise InputError(
            f"it is a {shape.geom_type}, and a tower is a point",
            file=path,
            place=place,
            remedy="Name the layer of points, or take the centroids first",
        )
    return float(shapely.get_x(shape)), float(shapely.get_y(shape))


def _crs(text: str | None) -> pyproj.CRS | None:
    import pyproj

    try:
        return None if text is None else pyproj.CRS(text)
    except pyproj.exceptions.CRSError:
        return None
