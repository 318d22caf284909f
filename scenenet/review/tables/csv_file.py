"""CSV files as spreadsheets save them: any of the usual separators and encodings."""

from __future__ import annotations

import csv
from pathlib import Path

from scenenet.core.errors import InputError
from scenenet.review.tables.table import Row, Table

SEPARATORS = ";\t,"
"""The separators that are known; of those in the header, the one that occurs most often counts."""


def read_csv(path: Path) -> Table:
    """The table in a CSV file with a header.

    Raises:
        InputError: the file cannot be read, is empty, or its rows do not fit its header.
    """
    lines = _decoded(path).splitlines(keepends=True)
    first = 1
    if lines and lines[0].lower().startswith("sep="):  # a hint for spreadsheets
        first, lines = 2, lines[1:]
    if not any(line.strip() for line in lines):
        raise InputError(
            "the file is empty", file=path, remedy="Save the table again, with a header"
        )
    separator = max(SEPARATORS, key=lines[0].count)
    try:
        records = list(csv.reader(lines, delimiter=separator))
    except csv.Error as error:
        raise InputError(f"this is not a CSV file ({error})", file=path) from None
    header = [name.strip() for name in records[0]]
    while header and not header[-1]:  # a separator at the end of each line
        header.pop()
    _check_header(path, header)
    rows = []
    for number, record in enumerate(records[1:], start=first + 1):
        if not any(cell.strip() for cell in record):
            continue
        if any(cell.strip() for cell in record[len(header) :]):
            raise InputError(
                f"it has {len(record)} cells, and the header has {len(header)} columns",
                file=path,
                place=f"row {number}",
                remedy='Put texts with a separator in quotes ("..."), and numbers with a decimal '
                "comma into a file with semicolons",
            )
        cells = [cell.strip() or None for cell in record[: len(header)]]
        cells += [None] * (len(header) - len(cells))
        rows.append(Row(path, f"row {number}", dict(zip(header, cells, strict=True))))
    return Table(path, tuple(header), tuple(rows))


def _decoded(path: Path) -> str:
    """The text of a file in UTF-8 or UTF-16, or in the Windows code page of western Europe.

    Raises:
        InputError: the file cannot be read.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(error.strerror or "cannot be read", file=path) from None
    encodings = ["utf-16"] if data[:2] in (b"\xff\xfe", b"\xfe\xff") else ["utf-8-sig", "cp1252"]
    for encoding in encodings:
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise InputError("this is not a text file", file=path, remedy="Save the table as CSV (UTF-8)")


def _check_header(path: Path, header: list[str]) -> None:
    for number, name in enumerate(header, start=1):
        if not name:
            raise InputError(
                f"column {number} has no name", file=path, place="header", remedy="Name it"
            )
        if name in header[: number - 1]:
            raise InputError(
                f"two columns have the name {name!r}",
                file=path,
                place="header",
                remedy="Rename or delete one of them",
            )
