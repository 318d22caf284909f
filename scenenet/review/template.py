"""A review file to fill in: the places at which the line and the list of towers do not agree, then
every tower of the list, the doubtful ones first."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from scenenet.core.columns import written
from scenenet.core.errors import InputError
from scenenet.core.files import atomic
from scenenet.line.notes import LineNote
from scenenet.prediction.tower_lists import arrays, write_layer
from scenenet.review.decisions import LAYER
from scenenet.review.doubts import Doubted, by_doubt
from scenenet.review.found_list import FoundList

COLUMNS: dict[str, type] = {
    "id": int, "decision": str, "comment": str, "reviewer": str, "doubts": str, "x": float,
    "y": float, "height": float, "base": float, "probability": float,
}  # fmt: skip
"""Columns of a review file, with the types of their values."""


def write_template(path: Path, found: FoundList) -> list[Doubted]:
    """Write a review file without decisions.

    Args:
        path: ``.csv``, or ``.gpkg`` for a layer ``LAYER`` of points in the CRS of the survey.

    Returns:
        the towers in the order of the file.

    Raises:
        InputError: the list lacks a column, or the path has another ending.
        OutputError: the file cannot be written.
    """
    import shapely

    if path.suffix.lower() not in (".csv", ".gpkg"):
        raise InputError("a review file is a .csv or .gpkg file", file=path)
    doubted = by_doubt(found)
    places = [note for note in found.notes if note.of_place]
    rows = [*map(_of_place, places), *map(_row, doubted)]
    with atomic(path) as partial:
        if path.suffix.lower() == ".csv":
            with partial.open("w", encoding="utf-8", newline="") as stream:
                table = csv.DictWriter(stream, list(COLUMNS), lineterminator="\n")
                table.writeheader()
                table.writerows(rows)
        else:
            values = {column: [row[column] for row in rows] for column in COLUMNS}
            points = [shapely.Point(row["x"], row["y"]) for row in rows]
            write_layer(partial, LAYER, "Point", points, arrays(values, COLUMNS), found.crs)
    return doubted


def _of_place(note: LineNote) -> dict[str, Any]:
    """A row without an id; a person who sees a tower there writes ``add``."""
    place = {"x": written(note.x), "y": written(note.y)}
    return {**dict.fromkeys(COLUMNS), "doubts": note.of_place, **place}


def _row(doubted: Doubted) -> dict[str, Any]:
    said = {"decision": None, "comment": None, "reviewer": None}
    row = {**doubted.tower.values, **said, "doubts": "; ".join(doubted.reasons)}
    return {column: row[column] for column in COLUMNS}
