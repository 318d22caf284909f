"""A comparison of a register as files: a table, layers for a map, and a record."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from scenenet.core.columns import written
from scenenet.prediction.tower_lists import arrays, write_layer
from scenenet.review.found_list import FoundList
from scenenet.review.record import RecordedFiles
from scenenet.review.register.compare import Comparison, Entry

COLUMNS: dict[str, type] = {
    "status": str, "asset": str, "tower": int, "asset_x": float, "asset_y": float,
    "tower_x": float, "tower_y": float, "distance_m": float, "east_m": float, "north_m": float,
}  # fmt: skip
"""Columns of the table and of the layers: the fields of ``Entry``, with their types."""

assert list(COLUMNS) == [field.name for field in fields(Entry)]


def register_files(found: FoundList, folder: Path) -> RecordedFiles:
    """The files of a comparison: table, GeoPackage, record."""
    name = folder / f"{found.name}.register"
    return RecordedFiles(
        name.with_name(f"{name.name}.json"),
        [name.with_name(f"{name.name}.csv"), name.with_name(f"{name.name}.gpkg")],
    )


def write_comparison(comparison: Comparison, found: FoundList, files: RecordedFiles) -> None:
    """Write a comparison.

    The table has a row for each entry. The GeoPackage, in the CRS of the survey, has the layers
    ``assets`` (each asset at its place in the register), ``new`` (towers that no asset has) and
    ``moves`` (a line from each place in the register to the tower).

    Raises:
        OutputError: a file cannot be written.
    """
    with files.writing(comparison.to_json()) as partial:
        table, package = (partial[path] for path in files.files)
        with table.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.DictWriter(stream, list(COLUMNS), lineterminator="\n")
            writer.writeheader()
            for entry in comparison.entries:  # all of its numbers are lengths
                writer.writerow({name: written(value) for name, value in asdict(entry).items()})
        _write_layers(package, comparison.entries, found)


def _write_layers(package: Path, entries: Sequence[Entry], found: FoundList) -> None:
    import shapely

    assets = [entry for entry in entries if entry.asset_x is not None]
    new = [entry for entry in entries if entry.status == "new"]
    moves = [entry for entry in assets if entry.tower is not None]
    layers: dict[str, tuple[str, Sequence[Entry], Any]] = {
        "assets": ("Point", assets, [shapely.Point(e.asset_x, e.asset_y) for e in assets]),
        "new": ("Point", new, [shapely.Point(e.tower_x, e.tower_y) for e in new]),
        "moves": (
            "LineString",
            moves,
            [shapely.LineString([(e.asset_x, e.asset_y), (e.tower_x, e.tower_y)]) for e in moves],
        ),
    }
    for name, (kind, rows, shapes) in layers.items():
        values = {column: [getattr(row, column) for row in rows] for column in COLUMNS}
        write_layer(package, name, kind, shapes, arrays(values, COLUMNS), found.crs)
