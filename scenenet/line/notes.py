"""Places at which a line and the list of towers do not agree: the only declaration of their kinds,
with what each output says of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from scenenet.core.columns import Record, column, columns_of

EXPECTED, UNHELD = "tower expected", "tower without a conductor"
FOUND_AGAIN = "tower found where the line expected one"
PASSED = "tower dropped: conductors pass it without a bend"
UNTRACED = "span expected"
"""What the line says of a place."""


@dataclass(frozen=True)
class NoteKind:
    """What the outputs say of a kind of places.

    Attributes:
        mark: name of the class of its mark on the map of the page.
        at_tower: whether a tower of the list stands there, so that the mark goes around that of
            the tower.
        of_place: why a person should look there, with ``{tower}`` and ``{to_tower}`` of the note;
            empty where a tower says it.
        of_tower: why a person should check the tower, or both towers; empty for no reason.
        of_span: why a person should check the span that says it; empty for no reason.
    """

    mark: str
    at_tower: bool = False
    of_place: str = ""
    of_tower: str = ""
    of_span: str = ""


NOTE_KINDS: Mapping[str, NoteKind] = MappingProxyType({
    EXPECTED: NoteKind(
        "expected",
        of_place="conductors end here: a tower is expected",
        of_span="its conductors end where the survey goes on: a tower is expected there that was "
        "not found",
    ),
    UNTRACED: NoteKind(
        "untraced",
        of_place="no span was traced between towers {tower} and {to_tower}: look for conductors, "
        "and for a tower amid them",
        of_tower="the line ends here, and the next tower faces it: no span was traced between them",
        of_span="its line ends here, and the next tower faces it: no span was traced between them",
    ),
    FOUND_AGAIN: NoteKind(
        "again", at_tower=True,
        of_tower="it was found only when it was looked for where the line expects a tower",
    ),
    UNHELD: NoteKind(
        "unheld", at_tower=True, of_tower="no conductor that was traced leads to it",
    ),
    PASSED: NoteKind(
        "passed", of_place="a tower was dropped here: conductors pass without a bend"
    ),
})  # fmt: skip
"""Every kind of places to look at, by what tables say of it, in the order of the page."""


@dataclass(frozen=True)
class LineNote(Record):
    """A place that a person should look at. ``NOTE_COLUMNS`` says what each column is."""

    x: float = column("m", "easting", heading="x")
    y: float = column("m", "northing", heading="y")
    what: str = column("", "; ".join(NOTE_KINDS), heading="what")
    tower: int = column(
        "", "id of the tower there, or at one side of a span that is expected; 0 for none",
        heading="tower",
    )  # fmt: skip
    span_id: int = column("", "number of the span that says it, 0 for none", heading="span")
    to_tower: int = column(
        "", "id of the other tower of a span that is expected, 0 for none", default=0
    )

    @property
    def towers(self) -> tuple[int, ...]:
        """Ids of the towers that it is about."""
        return tuple(number for number in (self.tower, self.to_tower) if number)

    @property
    def of_place(self) -> str:
        """Why a person should look there; empty where a tower says it."""
        return NOTE_KINDS[self.what].of_place.format(tower=self.tower, to_tower=self.to_tower)


NOTE_COLUMNS = columns_of(LineNote)
"""Every column of the list of places to look at, in order."""
