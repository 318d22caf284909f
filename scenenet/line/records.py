"""What is found of a line: its conductors, spans and expected towers, with the only declaration of
the columns of their tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from scenenet.core.columns import Record, column, columns_of
from scenenet.line.catenary import Catenary
from scenenet.line.notes import LineNote

AS_FLOWN = (
    "as flown: positions at the temperature, load and wind of the flight, not at other temperatures"
)
"""What every output about the wires of a line says of their positions."""


def positions_column() -> Any:
    """The column in which rows about wires say this."""
    return column("", "what positions of wires are", default=AS_FLOWN)


@dataclass(frozen=True)
class Conductor:
    """A conductor or an earth wire of a span. ``CONDUCTOR_COLUMNS`` says what each column is.

    Attributes:
        catenary: m, between its attachments; at an end without a tower, to its last point.
        tube: m, distance from the catenary within which points are its points.
        offsets: m, of the wires of its bundle to the left of the catenary and above it.
    """

    catenary: Catenary
    tube: float
    offsets: tuple[tuple[float, float], ...]
    span_id: int = column("", "number of its span", heading="span")
    conductor_id: int = column(
        "", "number in its span, from left to right and then from the top", heading="conductor"
    )
    kind: str = column(
        "", "conductor, earth wire, or cable: a wire of no line, or a slack one", heading="kind"
    )
    subconductors: int = column("", "number of wires of its bundle", heading="subconductors")
    from_tower: int = column("", "id of the tower at its start, 0 for none")
    to_tower: int = column("", "id of the tower at its end, 0 for none")
    c: float = column(
        "m", "catenary parameter: horizontal tension over weight per metre", heading="c"
    )
    sag: float = column(
        "m", "greatest vertical distance from the straight line between its ends", heading="sag",
        vertical=True,
    )  # fmt: skip
    blowout: float = column(
        "m", "how far wind moves its middle to the left of the straight line in plan"
    )
    length: float = column("m", "horizontal distance between its ends", heading="length")
    rmse: float = column(
        "m", "root mean square distance of its points from the catenary", heading="RMSE"
    )
    points: int = column("", "number of points that it was fitted to", heading="points")
    seen: float = column("1", "share of its length on which it has points", heading="seen")
    from_z: float = column(
        "m", "elevation of its start: where it is attached, if there is a tower", vertical=True
    )
    to_z: float = column("m", "elevation of its end", vertical=True)
    from_height: float = column(
        "m", "height of its start above the foot of the tower there; 0 without a tower",
        vertical=True,
    )  # fmt: skip
    to_height: float = column(
        "m", "height of its end above the foot of the tower there; 0 without a tower",
        vertical=True,
    )  # fmt: skip
    positions: str = positions_column()

    def to_json(self) -> dict[str, Any]:
        own = {c.name: c.value(self) for c in CONDUCTOR_COLUMNS}
        curve = self.catenary
        return own | {
            "tube": self.tube,
            "offsets": [list(each) for each in self.offsets],
            "catenary": [*curve.start, *curve.end, curve.parameter],
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """What ``to_json`` gave."""
        x, y, z, far_x, far_y, far_z, parameter = data["catenary"]
        own = {c.name: data[c.name] for c in CONDUCTOR_COLUMNS}
        curve = Catenary((x, y, z), (far_x, far_y, far_z), parameter, data["blowout"])
        offsets = tuple((left, above) for left, above in data["offsets"])
        return cls(catenary=curve, tube=data["tube"], offsets=offsets, **own)


@dataclass(frozen=True)
class LineSpan(Record):
    """A span of a line. ``SPAN_COLUMNS`` says what each column is.

    Attributes:
        start, end: (x, y) m, the feet of its towers, or where its longest conductor ends.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    span_id: int = column("", "number that follows from its place, unique in the survey",
                          heading="span")  # fmt: skip
    line: int = column(
        "", "number of the line that it belongs to; 0 for cables of no line", heading="line"
    )
    order: int = column("", "its place along the line, from 1", heading="order")
    from_tower: int = column("", "id of the tower at its start, 0 for none", heading="from")
    to_tower: int = column("", "id of the tower at its end, 0 for none", heading="to")
    length: float = column("m", "horizontal distance between its ends", heading="length")
    angle: float = column(
        "degrees", "change of direction of the line at its end, to the right; 0 without a next "
        "span", heading="angle",
    )  # fmt: skip
    conductors: int = column("", "conductors, without earth wires", heading="conductors")
    earth_wires: int = column("", "earth wires", heading="earth wires")
    worst_rmse: float = column("m", "largest RMSE of its conductors", heading="worst RMSE")
    ends: str = column(
        "", "what is known of its ends: between towers, leaves the survey, tower expected, span "
        "expected, or cable", heading="ends",
    )  # fmt: skip
    positions: str = positions_column()

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """What ``to_json`` gave."""
        return cls(**{**data, "start": tuple(data["start"]), "end": tuple(data["end"])})


@dataclass(frozen=True)
class Support(Record):
    """A tower as the line shows it. ``SUPPORT_COLUMNS`` says what each column is."""

    x: float = column("m", "easting")
    y: float = column("m", "northing")
    tower: int = column("", "id of the tower", heading="tower")
    line: int = column("", "number of its line", heading="line")
    spans: int = column("", "spans that it holds: 1 at the end of a line, more than 2 at a branch",
                        heading="spans")  # fmt: skip
    conductors: int = column(
        "", "conductors of the span at it that has most; the next columns are of this span",
        heading="conductors",
    )  # fmt: skip
    earth_wires: int = column("", "earth wires", heading="earth wires")
    levels: str = column(
        "", "conductors at each height, from the top: 3 is a horizontal arrangement, 1+2 a "
        "triangle, 2+2+2 a double circuit on three crossarms", heading="levels",
    )  # fmt: skip
    lowest: float = column("m", "height of the lowest conductor above its foot", vertical=True)
    highest: float = column("m", "height of the highest one", vertical=True)
    body: str = column(
        "", "pole, if it is less than 1 m wide at half its height, or lattice", heading="body"
    )


CONDUCTOR_COLUMNS = columns_of(Conductor)
"""Every column of the list of conductors, in order."""

SPAN_COLUMNS = columns_of(LineSpan)
"""Every column of the list of spans, in order."""

SUPPORT_COLUMNS = columns_of(Support)
"""Every column of the list of towers of lines, in order."""


@dataclass(frozen=True)
class SurveyLine:
    """The lines of a survey.

    Attributes:
        spans: line by line, each in order.
        conductors: span by span.
        notes: places to look at.
        supports: the towers that are in a line.
        rejected: conductors that people rejected; they count nowhere else.
    """

    spans: tuple[LineSpan, ...]
    conductors: tuple[Conductor, ...]
    notes: tuple[LineNote, ...]
    supports: tuple[Support, ...] = ()
    rejected: tuple[Conductor, ...] = ()

    def to_json(self) -> dict[str, Any]:
        return {
            "spans": [span.to_json() for span in self.spans],
            "conductors": [conductor.to_json() for conductor in self.conductors],
            "notes": [note.to_json() for note in self.notes],
            "supports": [support.to_json() for support in self.supports],
            "rejected": [conductor.to_json() for conductor in self.rejected],
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """What ``to_json`` gave."""
        return cls(
            tuple(map(LineSpan.from_json, data["spans"])),
            tuple(map(Conductor.from_json, data["conductors"])),
            tuple(map(LineNote.from_json, data["notes"])),
            tuple(map(Support.from_json, data["supports"])),
            tuple(map(Conductor.from_json, data["rejected"])),
        )
