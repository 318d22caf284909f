"""Conductors at another temperature: the catenary parameter of a table between the attachments as
flown.

This is a model. It knows the attachments of the flight and the parameter c that a user names for a
span, from a sag-tension calculation or a stringing table. It leaves out what moves the attachments
(insulator strings that swing along the line), and there is no wind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from scenenet.clearance.settings import SpanSag
from scenenet.clearance.settings_table import read_rows
from scenenet.core.errors import InputError
from scenenet.line.catenary import Catenary
from scenenet.line.records import Conductor, SurveyLine

SLACKEST = 0.5
"""A wire that is given a sag of more than this share of its span has a wrong parameter."""


def read_sags(path: Path) -> tuple[SpanSag, ...]:
    """The rows of a table of catenary parameters.

    Raises:
        InputError: the file cannot be read, lacks a column, a value is not possible, or two rows
            are about the same wire.
    """
    found: dict[tuple[int, int | None], SpanSag] = {}
    for place, sag in read_rows(path, SpanSag, "m and degrees Celsius"):
        if (sag.span, sag.conductor) in found:
            raise InputError(
                f"span {sag.span} is there twice", file=path, place=place,
                remedy="Keep one row for each span, or for each conductor of it",
            )  # fmt: skip
        found[sag.span, sag.conductor] = sag
    return tuple(found.values())


def with_sags(line: SurveyLine, sags: Sequence[SpanSag]) -> SurveyLine:
    """The line with its conductors as they hang by a table; those that it does not name are as
    flown.

    Raises:
        InputError: a parameter lets a wire sag by more than half of its span.
    """
    by_wire = {(sag.span, sag.conductor): sag for sag in sags}
    wires = []
    for wire in line.conductors:
        sag = by_wire.get((wire.span_id, wire.conductor_id))
        if sag is None and wire.kind != "earth wire":
            sag = by_wire.get((wire.span_id, None))
        wires.append(wire if sag is None else _with_parameter(wire, sag))
    return replace(line, conductors=tuple(wires))


def without_conductor(line: SurveyLine, sags: Sequence[SpanSag]) -> list[int]:
    """The spans of a table of which the line has no conductor."""
    return sorted({sag.span for sag in sags} - {wire.span_id for wire in line.conductors})


def _with_parameter(wire: Conductor, sag: SpanSag) -> Conductor:
    """A conductor between its attachments with another parameter, and without wind."""
    flown = wire.catenary
    curve = Catenary(flown.start, flown.end, sag.c)
    # A parameter far too small overflows.
    if sag.c * 10 < flown.length or curve.sag > SLACKEST * flown.length:
        raise InputError(
            f"the catenary parameter {sag.c:g} m lets conductor {wire.conductor_id} of span "
            f"{wire.span_id} sag by more than half of its {flown.length:.0f} m",
            file=sag.source or None,
            remedy="Give the horizontal tension over the weight per metre, in m",
        )
    at = "another temperature" if sag.temperature is None else f"{sag.temperature:g} degrees C"
    source = f" of {sag.source}" if sag.source else ""
    return replace(
        wire, catenary=curve, c=sag.c, sag=curve.sag, blowout=0.0,
        positions=f"modelled at {at}: catenary parameter{source} between the attachments as "
        "flown, without wind",
    )  # fmt: skip
