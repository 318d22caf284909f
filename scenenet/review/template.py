"""A review file to fill in: the places at which the line and the list of towers do not agree, then
every tower of the list and every conductor of its line, the doubtful ones first."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scenenet.core.columns import written
from scenenet.core.errors import InputError
from scenenet.core.files import atomic
from scenenet.line.notes import LineNote
from scenenet.prediction.tower_lists import arrays, write_layer
from scenenet.review.decisions import LAYER
from scenenet.review.doubts import Doubted, by_doubt, conductors_by_doubt
from scenenet.review.found_list import FoundList
from scenenet.review.listed_conductor import ListedConductor

COLUMNS: dict[str, type] = {
    "id": int, "decision": str, "comment": str, "reviewer": str, "doubts": str, "x": float,
    "y": float, "height": float, "base": float, "probability": float,
}  # fmt: skip
"""Columns of a review file, with the types of their values."""

CONDUCTOR_COLUMNS: dict[str, type] = {"span": int, "conductor": int, "z": float}
"""Further columns of one that lists conductors too."""


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
    wires = conductors_by_doubt(found)
    rows = [*map(_of_place, places), *map(_row, doubted), *(_of_conductor(*w) for w in wires)]
    columns = {**COLUMNS, **CONDUCTOR_COLUMNS} if wires else COLUMNS
    with atomic(path) as partial:
        if path.suffix.lower() == ".csv":
            with partial.open("w", encoding="utf-8", newline="") as stream:
                table = csv.DictWriter(stream, list(columns), lineterminator="\n")
                table.writeheader()
                table.writerows(rows)
        else:
            values = {column: [row.get(column) for row in rows] for column in columns}
            points = [shapely.Point(row["x"], row["y"]) for row in rows]
            write_layer(partial, LAYER, "Point", points, arrays(values, columns), found.crs)
    return doubted


def _of_place(note: LineNote) -> dict[str, Any]:
    """A row without an id; a person who sees a tower there writes ``add``."""
    place = {"x": written(note.x), "y": written(note.y)}
    return {**dict.fromkeys(COLUMNS), "doubts": note.of_place, **place}


def _of_conductor(conductor: ListedConductor, reasons: Sequence[str]) -> dict[str, Any]:
    """A row with the middle of a conductor. One that the prediction left out stays rejected."""
    names = "x", "y", "z"
    place = {name: written(part) for name, part in zip(names, conductor.middle, strict=True)}
    numbers = {"span": conductor.span_id, "conductor": conductor.conductor_id}
    decision = "reject" if conductor.rejected else None
    said = {"decision": decision, "doubts": "; ".join(reasons)}
    return {**dict.fromkeys(COLUMNS), **said, **numbers, **place}


def _row(doubted: Doubted) -> dict[str, Any]:
    said = {"decision": None, "comment": None, "reviewer": None}
    row = {**doubted.tower.values, **said, "doubts": "; ".join(doubted.reasons)}
    return {column: row[column] for column in COLUMNS}
