"""Pieces of a page as text."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any


def note(title: str, sentences: Iterable[str]) -> str:
    """A box with sentences."""
    items = "".join(f"<li>{escape(text)}</li>" for text in sentences)
    return f'<div class="notes"><h2>{escape(title)}</h2><ul>{items}</ul></div>\n'


def headings(columns: Iterable[tuple[str, str, str]]) -> str:
    """The heading of a list that sorts.

    Args:
        columns: title, description, and ``number`` or ``text``, of each.
    """
    return "".join(
        f'<th scope="col" class="{kind}" title="{escape(description)}">'
        f'<button type="button">{escape(title)}</button></th>'
        for title, description, kind in columns
    )


def row(what: str, number: int, kind: str, state: str, cells: Sequence[tuple[str, str]]) -> str:
    """A row of a list that sorts.

    Args:
        what: it lists, in the name of the attribute with ``number``.
        kind: class of the row: what its state is.
        state: the same in words.
        cells: text and class of each further cell.
    """
    further = "".join(f'<td class="{of}">{escape(text)}</td>' for text, of in cells)
    return (
        f'<tr data-{what}="{number}" class="{kind}"><th scope="row" class="number">'
        f'<button type="button" tabindex="-1">{number}</button></th>'
        f'<td><span class="state">{escape(state)}</span></td>{further}</tr>'
    )


def facts(pairs: Iterable[tuple[str, str]]) -> str:
    """Names with their values."""
    return "".join(
        f"<div><dt>{escape(name)}</dt><dd>{escape(text)}</dd></div>" for name, text in pairs
    )


def json_text(data: Any) -> str:
    """JSON that may stand in a script element, whatever its texts are."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace("&", "\\u0026")


def count(number: int) -> str:
    """A count with narrow spaces between thousands."""
    return f"{number:,}".replace(",", "\u202f")
