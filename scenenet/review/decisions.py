"""Review files: what people decided about the towers and conductors of a survey, a row each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from scenenet.core.errors import InputError
from scenenet.core.files import digest
from scenenet.review.places import NoPlaces, PlaceColumns, in_survey
from scenenet.review.tables.table import Row, Table, read_table

if TYPE_CHECKING:
    import pyproj

    from scenenet.review.found_list import FoundList

Decision = Literal["accept", "reject", "add", "comment"]

DECISIONS: tuple[Decision, ...] = get_args(Decision)

SPAN, CONDUCTOR = ("span", "span id"), ("conductor", "conductor id")
"""Names of the columns with the numbers of a conductor."""

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
        place: x and y; None without coordinates.
        crs: system of the place; None for that of the survey.
        base, height: of an added tower, in the units of the survey; None if not given.
        comment, reviewer: empty if not given.
        span, conductor: numbers of a conductor; a row with the latter is about one.
        z: elevation of the place of a conductor, in the units of the survey.
    """

    row: Row
    decision: Decision
    id: int | None
    place: tuple[float, float] | None
    base: float | None
    height: float | None
    comment: str
    reviewer: str
    crs: pyproj.CRS | None = None
    span: int | None = None
    conductor: int | None = None
    z: float | None = None

    def in_survey(self, survey: pyproj.CRS | None) -> Said:
        """The same with its place in the system of the survey.

        Raises:
            InputError: it cannot be there.
        """
        if self.place is None:
            return self
        [(x, y)] = in_survey([self.row], [self.place], self.crs, survey).tolist()
        return replace(self, place=(x, y), crs=None)


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

    @property
    def of_towers(self) -> tuple[Said, ...]:
        """What is said about towers."""
        return tuple(each for each in self.said if each.conductor is None)

    @property
    def of_conductors(self) -> tuple[Said, ...]:
        """What is said about conductors."""
        return tuple(each for each in self.said if each.conductor is not None)

    def in_survey(self, survey: pyproj.CRS | None) -> Statements:
        """The same with all places in the system of the survey; None if that is not known."""
        said: list[Said] = []
        errors = list(self.errors)
        for each in self.said:
            try:
                said.append(each.in_survey(survey))
            except InputError as error:
                errors.append(error)
        return replace(self, said=tuple(said), errors=tuple(errors))


def read_decisions(
    paths: Sequence[Path], found: FoundList, crs: pyproj.CRS | None = None
) -> Statements:
    """What review files say about the survey of a list; arguments and errors as ``read_rows``."""
    return read_rows(paths, crs).in_survey(found.crs)


def read_rows(paths: Sequence[Path], crs: pyproj.CRS | None = None) -> Statements:
    """What review files say, with places as they are in the files.

    Args:
        paths: CSV files, or GeoPackages with a layer ``LAYER``.
        crs: system of the coordinates in files that state none; None for that of the survey.

    Raises:
        InputError: a file cannot be read, or has no column for the decisions.
    """
    together = Statements((), (), 0)
    for path in paths:
        together += _read_file(path, crs)
    return together


def about_conductors(path: Path) -> str:
    """A digest of what a review file decides about conductors; empty if that is nothing, or if the
    file cannot be read. Comments, and what it says of towers, do not change it."""
    try:
        said = read_rows([path]).of_conductors
    except InputError:
        return ""
    decided = [
        (each.decision, each.span, each.conductor, each.place, each.z, str(each.crs))
        for each in said
        if each.decision != "comment"
    ]
    return digest(decided) if decided else ""


def refuse(errors: Sequence[InputError]) -> None:
    """Refuse review files with errors in their rows.

    Raises:
        InputError: there is one; all of them are named.
    """
    if errors:
        listed = "".join(f"\n  {error}" for error in errors)
        raise InputError(f"{len(errors)} decisions cannot be used, so none was applied:{listed}")


def _read_file(path: Path, crs: pyproj.CRS | None) -> Statements:
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
                said.append(read)
        except InputError as error:
            errors.append(error)
    return Statements(tuple(said), tuple(errors), undecided)


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
    span: str | None
    conductor: str | None
    z: str | None

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
        if id is None and places is None and table.column(CONDUCTOR) is None:
            raise table.error(f"there is no column id, and no x and y, among {listed}", remedy)
        names = ("base",), ("height",), ("comment",), ("reviewer",), SPAN, CONDUCTOR, ("z",)
        return cls(decision, id, places, *map(table.column, names))

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
            crs=None if self.places is None else self.places.crs,
            span=row.whole_number(self.span),
            conductor=row.whole_number(self.conductor),
            z=row.number(self.z),
        )
