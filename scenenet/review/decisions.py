"""Review files: what people decided about the towers of a list, a row each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from scenenet.core.errors import InputError
from scenenet.review.found_list import FoundList
from scenenet.review.places import NoPlaces, PlaceColumns, in_survey
from scenenet.review.tables.table import Row, Table, read_table

if TYPE_CHECKING:
    import pyproj

Decision = Literal["accept", "reject", "add", "comment"]

DECISIONS: tuple[Decision, ...] = get_args(Decision)

LAYER = "review"
"""Layer of a GeoPackage with decisions."""

_WORDS: dict[str, Decision] = {
    **{word: word for word in DECISIONS},
    "accepted": "accept", "rejected": "reject", "added": "add",
}  # fmt: skip


@dataclass(frozen=True)
class Said:
    """What a row of a review file says.

    Attributes:
        row: the row.
        decision: accept, reject or add a tower, or only a comment.
        id: of the tower; None where the row names it by its place.
        place: x and y in the CRS and the units of the survey; None without coordinates.
        base, height: of an added tower, in the units of the survey; None if not given.
        comment, reviewer: empty if not given.
    """

    row: Row
    decision: Decision
    id: int | None
    place: tuple[float, float] | None
    base: float | None
    height: float | None
    comment: str
    reviewer: str


@dataclass(frozen=True)
class Statements:
    """What review files say.

    Attributes:
        said: row by row.
        errors: of the rows that cannot be used.
        undecided: number of rows without a decision and without a comment.
    """

    said: tuple[Said, ...]
    errors: tuple[InputError, ...]
    undecided: int

    def __add__(self, other: Statements) -> Statements:
        return Statements(
            self.said + other.said, self.errors + other.errors, self.undecided + other.undecided
        )


def read_decisions(
    paths: Sequence[Path], found: FoundList, crs: pyproj.CRS | None = None
) -> Statements:
    """What review files say about the towers of a list.

    Args:
        paths: CSV files, or GeoPackages with a layer ``LAYER``.
        crs: system of the coordinates in files that state none; None for that of the survey.

    Raises:
        InputError: a file cannot be read, or has no column for the decisions.
    """
    together = Statements((), (), 0)
    for path in paths:
        together += _read_file(path, found, crs)
    return together


def _read_file(path: Path, found: FoundList, crs: pyproj.CRS | None) -> Statements:
    table = read_table(path, LAYER if path.suffix.lower() == ".gpkg" else None)
    columns = _Columns.of(table, crs)
    said: list[Said] = []
    errors: list[InputError] = []
    undecided = 0
    for row in table.rows:
        try:
            read = columns.said(row)
            if read is None:
                undecided += 1
            else:
                said.append(_in_survey(read, columns, found))
        except InputError as error:
            errors.append(error)
    return Statements(tuple(said), tuple(errors), undecided)


def _in_survey(said: Said, columns: _Columns, found: FoundList) -> Said:
    """The same with its place in the system of the survey."""
    if said.place is None or columns.places is None:
        return said
    [(x, y)] = in_survey([said.row], [said.place], columns.places.crs, found.crs).tolist()
    return replace(said, place=(x, y))


@dataclass(frozen=True)
class _Columns:
    """The columns of a review file; None for one that it does not have."""

    decision: str
    id: str | None
    places: PlaceColumns | None
    base: str | None
    height: str | None
    comment: str | None
    reviewer: str | None

    @classmethod
    def of(cls, table: Table, crs: pyproj.CRS | None) -> _Columns:
        """The columns of a table.

        Raises:
            InputError: it has no decisions, or nothing that names a tower.
        """
        decision = table.column(("decision",))
        id = table.column(("id", "tower id", "tower"))
        listed = ", ".join(table.columns)
        remedy = "Write one with scenenet review FOUND --template FILE, and fill it in"
        if decision is None:
            raise table.error(f"there is no column decision among {listed}", remedy)
        try:
            places = PlaceColumns.of(table, crs=crs)
        except NoPlaces:
            places = None
        if id is None and places is None:
            raise table.error(f"there is no column id, and no x and y, among {listed}", remedy)
        others = (table.column((name,)) for name in ("base", "height", "comment", "reviewer"))
        return cls(decision, id, places, *others)

    def said(self, row: Row) -> Said | None:
        """What a row says, with its place as it is in the file; None if it says nothing.

        Raises:
            InputError: the decision is not known, or a cell is not a number.
        """
        word, comment = row.text(self.decision).lower(), row.text(self.comment)
        if not word and not comment:
            return None
        if word and word not in _WORDS:
            raise row.error(
                f"{row.text(self.decision)!r} is not a decision",
                f"Write {', '.join(DECISIONS)}, or leave the cell empty",
            )
        return Said(
            row=row,
            decision=_WORDS[word] if word else "comment",
            id=row.whole_number(self.id),
            place=None if self.places is None else self.places.place(row),
            base=row.number(self.base),
            height=row.number(self.height),
            comment=comment,
            reviewer=row.text(self.reviewer),
        )
