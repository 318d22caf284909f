"""Tables whose columns are the fields of a dataclass: each is declared once, with its unit and
what it is, and the files, the report and the reference pages follow from that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, Self, TypeVar, get_args, get_origin, get_type_hints

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Row = TypeVar("Row", bound="DataclassInstance")


def column(
    unit: str,
    description: str,
    *,
    heading: str | None = None,
    vertical: bool = False,
    default: Any = MISSING,
) -> Any:
    """A field that is a column; arguments as the attributes of ``FieldColumn``, and the value of
    rows that do not say it."""
    facts = {"unit": unit, "description": description, "heading": heading, "vertical": vertical}
    return field(metadata=facts, default=default)


@dataclass(frozen=True)
class FieldColumn:
    """A column of a table.

    Attributes:
        name: attribute of the dataclass, and name in files.
        unit: ``m``, ``degrees``, ``1`` for a ratio, empty for a count or number.
        description: what it is, for the reference page.
        heading: name in tables for people, without the unit; None where tables leave it out.
        vertical: whether its length is along z, whose unit may differ from that of x and y.
        type: of its values: ``int``, ``float``, ``str``, ``bool``, ``tuple`` or ``Mapping``.
            A value may be None where the field allows it.
    """

    name: str
    unit: str
    description: str
    heading: str | None
    vertical: bool
    type: type

    def value(self, row: Any) -> Any:
        """The value of this column for a row."""
        return getattr(row, self.name)


@dataclass(frozen=True)
class Record:
    """A row that is kept as JSON between the stages of a program."""

    def to_json(self) -> dict[str, Any]:
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """What ``to_json`` gave."""
        return cls(**data)


def written(value: Any) -> Any:
    """A length as tables have it, to a tenth of a millimetre; any other value as it is."""
    return round(value, 4) if isinstance(value, float) else value


def columns_of(kind: type) -> tuple[FieldColumn, ...]:
    """The columns that a dataclass declares with ``column``, in order."""
    types = get_type_hints(kind)
    return tuple(
        FieldColumn(
            name=f.name,
            unit=f.metadata["unit"],
            description=f.metadata["description"],
            heading=f.metadata["heading"],
            vertical=f.metadata["vertical"],
            type=_type(types[f.name]),
        )
        for f in fields(kind)
        if "unit" in f.metadata
    )


def _type(hint: Any) -> Any:
    """The type of the values that are not None."""
    if isinstance(hint, UnionType):
        hint = next(each for each in get_args(hint) if each is not NoneType)
    return get_origin(hint) or hint


def in_units(row: Row, sizes: tuple[float, float, float]) -> Row:
    """A row whose lengths in m become lengths in units of which x, y and z have ``sizes`` in m.

    None stays None.
    """
    planar, _, vertical = sizes
    lengths = [each for each in columns_of(type(row)) if each.unit == "m"]
    known = [(c, c.value(row)) for c in lengths if c.value(row) is not None]
    return replace(
        row, **{c.name: value / (vertical if c.vertical else planar) for c, value in known}
    )
