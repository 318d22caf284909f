"""The tower list as files: CSV, GeoPackage, and GeoJSON for maps on the web."""

from __future__ import annotations

import csv
import sqlite3
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from scenenet.core.files import write_json
from scenenet.core.gdal import load_pyogrio
from scenenet.detection.survey_tower import SurveyTower, row_types
from scenenet.prediction.file_status import SurveyFile
from scenenet.prediction.styles import STYLES
from scenenet.prediction.work.tiling import TileSpool

if TYPE_CHECKING:
    import pyproj

LONGITUDE_LATITUDE = 4326
"""EPSG code of the coordinates of GeoJSON (RFC 7946)."""

WRITTEN = "1970-01-01T00:00:00.000Z"
"""Time of writing in a GeoPackage: a fixed one, so that equal predictions give equal files."""

COVERAGE_CELL = 8
"""Voxels along the edge of the cells that make up the coverage."""


class TowerEntry(Protocol):
    """A tower as a list has it: one that was found, or one that people added."""

    @property
    def x(self) -> float:
        """In the CRS and the units of the survey."""

    @property
    def y(self) -> float:
        """As ``x``."""

    @property
    def base(self) -> float | None:
        """Elevation of its foot, in the unit of the heights; None if it is not known."""

    def to_row(self) -> dict[str, Any]:
        """Its values by column, as a table holds them; None for what is not known."""

    def to_feature(self, coordinates: Sequence[float]) -> dict[str, Any]:
        """The tower as a GeoJSON feature at ``coordinates``."""


def write_csv(path: str | Path, towers: Iterable[TowerEntry], columns: Iterable[str]) -> None:
    """Write towers as CSV, with x and y in the coordinates of the survey."""
    with Path(path).open("w", encoding="utf-8", newline="") as stream:
        table = csv.DictWriter(stream, list(columns), lineterminator="\n")
        table.writeheader()
        table.writerows(tower.to_row() for tower in towers)


def write_geojson(
    path: str | Path,
    towers: Sequence[TowerEntry],
    crs: pyproj.CRS | None,
    unit_sizes: tuple[float, float, float],
) -> None:
    """Write the tower list as GeoJSON.

    The coordinates are longitude and latitude in degrees and the elevation of the foot in m, as RFC
    7946 prescribes. Where the CRS is unknown they are those of the survey, and the member
    ``coordinates`` of the collection is ``survey``. Properties are in the units of the survey.

    Args:
        towers, crs: of the survey.
        unit_sizes: sizes in m of the units of its x, y and z.
    """
    vertical = 1.0 if crs is None else unit_sizes[2]
    places = np.array([(tower.x, tower.y) for tower in towers]).reshape(-1, 2)
    collection: dict[str, Any] = {"type": "FeatureCollection"}
    if crs is None:
        collection["coordinates"] = "survey"
    elif len(towers):
        from pyproj import Transformer

        to_degrees = Transformer.from_crs(crs.to_2d(), LONGITUDE_LATITUDE, always_xy=True)
        places = np.column_stack(to_degrees.transform(*places.T))
    elevations = ([] if t.base is None else [t.base * vertical] for t in towers)
    collection["features"] = [
        tower.to_feature([*map(float, place), *elevation])
        for tower, place, elevation in zip(towers, places, elevations, strict=True)
    ]
    write_json(path, collection)


def write_geopackage(
    path: str | Path,
    towers: Sequence[SurveyTower] | None,
    geneos: Sequence[str],
    crs: pyproj.CRS | None,
    unit_sizes: tuple[float, float, float],
    spool: TileSpool,
    files: Sequence[SurveyFile],
    targets: Sequence[str],
    more: Callable[[Path], Sequence[str]] | None = None,
) -> None:
    """Write the tower list as a GeoPackage in the CRS of the survey, with styles for QGIS.

    Its layers are ``towers`` (PointZ, at the foot, with the columns of the CSV file), ``coverage``
    (the cells with a point) and ``tiles`` (the files of the survey, with their status).

    Args:
        path: ends in ``.gpkg``.
        towers: None if none were looked for; there is no layer ``towers`` then.
        geneos: names of the GENEOs of the model.
        crs: of the survey; None if it is not known.
        unit_sizes: sizes in m of the units of its x, y and z.
        spool: the occupied voxels of the survey.
        files: of the survey, a row each in the layer ``tiles``.
        targets: names of what was looked for.
        more: adds further layers to the file, and returns their names.
    """
    import shapely

    parts = shapely.get_parts(coverage(spool))
    area = shapely.area(parts)
    parts = shapely.transform(parts, lambda xy: xy / unit_sizes[0])
    extents = [shapely.Polygon() if f.extent is None else shapely.box(*f.extent) for f in files]
    facts = [file.to_json(targets) for file in files]
    attributes = {name: np.array([row[name] for row in facts]) for name in facts[0]}
    if towers is not None:
        write_tower_layer(path, "towers", towers, row_types(geneos), crs)
    others = () if more is None else more(Path(path))
    write_layer(path, "coverage", "Polygon", parts, {"area_m2": area}, crs)
    write_layer(path, "tiles", "Polygon", extents, attributes, crs)
    add_styles(path, [*(["towers"] if towers is not None else []), *others, "coverage", "tiles"])


def coverage(spool: TileSpool) -> Any:
    """The cells of ``COVERAGE_CELL`` voxels that hold a point, as one shapely geometry, m."""
    import shapely

    cells: set[tuple[int, int]] = set()
    for tile in spool.tiles():
        held = np.unique(tile.zyx()[:, 1:] // COVERAGE_CELL, axis=0)
        cells.update(map(tuple, held.tolist()))
    if not cells:
        return shapely.Polygon()
    steps = np.array(sorted(cells))[:, ::-1]
    # Neighbours share their corners exactly: both are products of the same numbers.
    low, high = ((steps + shift) * (COVERAGE_CELL * spool.voxel_size) for shift in (0, 1))
    return shapely.union_all(shapely.box(*low.T, *high.T))


def write_tower_layer(
    path: str | Path,
    name: str,
    towers: Sequence[TowerEntry],
    columns: Mapping[str, type],
    crs: pyproj.CRS | None,
) -> None:
    """Add a layer with the foot of each tower (PointZ) to a GeoPackage, or start it.

    Args:
        name: of the layer.
        columns: column -> type of its values: ``int``, ``float`` or ``str``.
        crs: of the survey; None if it is not known.
    """
    import shapely

    rows = [tower.to_row() for tower in towers]
    feet = np.array([(t.x, t.y, np.nan if t.base is None else t.base) for t in towers])
    fields = {column: [row[column] for row in rows] for column in columns}
    write_layer(
        path, name, "Point Z", shapely.points(feet.reshape(-1, 3)), arrays(fields, columns), crs
    )


def arrays(
    fields: Mapping[str, Sequence[Any]], columns: Mapping[str, type]
) -> dict[str, np.ma.MaskedArray]:
    """The values of columns as arrays, with a mask where a value is None.

    The types make the columns of an empty table the same as those of a full one.

    Args:
        fields: column -> its values.
        columns: column -> type of its values: ``int``, ``float`` or ``str``.
    """
    made: dict[str, np.ma.MaskedArray] = {}
    for name, kind in columns.items():
        mask = [value is None for value in fields[name]]
        filled = [kind() if value is None else value for value in fields[name]]
        made[name] = np.ma.array(
            np.array(filled, dtype=object if kind is str else kind), mask=np.array(mask, bool)
        )
    return made


def write_layer(
    path: str | Path,
    name: str,
    kind: str,
    geometry: Any,
    fields: Mapping[str, np.ndarray],
    crs: pyproj.CRS | None,
) -> None:
    """Add a layer to a GeoPackage, or start it.

    Args:
        path: of the GeoPackage.
        name: of the layer.
        kind: geometry type of OGR, such as ``Point Z``.
        geometry: shapely geometries, one for each row.
        fields: column -> its values, one for each row; a masked one is null.
        crs: of the coordinates; None if it is not known.
    """
    import shapely

    gdal = load_pyogrio()
    # The file appears when it is whole. To wait for the disk after each layer would add nothing.
    gdal.set_gdal_config_options({"OGR_CURRENT_DATE": WRITTEN, "OGR_SQLITE_SYNCHRONOUS": "OFF"})
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")  # the survey has none
        gdal.raw.write(
            path,
            layer=name,
            driver="GPKG",
            geometry=shapely.to_wkb(np.asarray(geometry, object), output_dimension=3),
            geometry_type=kind,
            field_data=[np.ma.getdata(values) for values in fields.values()],
            field_mask=[np.ma.getmaskarray(values) for values in fields.values()],
            fields=list(fields),
            crs=None if crs is None else crs.to_2d().to_wkt(),
            append=Path(path).exists(),
        )


def add_styles(path: str | Path, layers: Iterable[str], styles: Mapping[str, str] = STYLES) -> None:
    """Add the table from which QGIS takes the styles of ``layers``, by their names."""
    with closing(sqlite3.connect(path)) as database, database:
        database.execute(
            "CREATE TABLE layer_styles (id INTEGER PRIMARY KEY, f_table_catalog TEXT, "
            "f_table_schema TEXT, f_table_name TEXT, f_geometry_column TEXT, styleName TEXT, "
            "styleQML TEXT, styleSLD TEXT, useAsDefault BOOLEAN, description TEXT, owner TEXT, "
            "ui TEXT, update_time DATETIME DEFAULT CURRENT_TIMESTAMP)"
        )
        database.execute(
            "INSERT INTO gpkg_contents (table_name, data_type, identifier, last_change) "
            "VALUES ('layer_styles', 'attributes', 'layer_styles', ?)",
            [WRITTEN],
        )
        database.executemany(
            "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, "
            "f_geometry_column, styleName, styleQML, styleSLD, useAsDefault, update_time) "
            "VALUES ('', '', ?, 'geom', ?, ?, '', 1, ?)",
            [(layer, layer, styles[layer], WRITTEN) for layer in layers],
        )
