"""The list of the spans of a survey, and what its page shows of each."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenenet.clearance.records import Clearance, FallTree, ProfileStep
from scenenet.clearance.settings import KINDS, ClearanceLimits
from scenenet.line.frame import SpanFrame
from scenenet.line.records import Conductor
from scenenet.prediction.page.budget import MOST_PLACES
from scenenet.prediction.page.markup import headings, row
from scenenet.prediction.page.span_facts import SpanFacts
from scenenet.prediction.page.span_pictures import PICTURED, SpanPicture

BETWEEN = "between towers"
"""What is known of the ends of most spans."""

NAMES = {"danger": "too near", "check": "to check", "found": "found"}
"""State of a span -> what the list calls it."""


@dataclass(frozen=True)
class LengthUnits:
    """Units of the survey.

    Attributes:
        planar_m, vertical_m: sizes in m of those of x and y, and of z.
        planar, vertical: what follows a number.
    """

    planar_m: float
    vertical_m: float
    planar: str
    vertical: str


def span_headings(units: LengthUnits) -> str:
    """The heading of the list."""
    unit = f" [{units.planar}]"
    return headings([
        ("span", "number that follows from its place, unique in the survey", "number"),
        ("state", "too near: a place closer than the limit; to check: a reason to doubt it",
         "text"),
        ("worst", "kind with the smallest margin, or without limits the smallest distance",
         "text"),
        (f"distance{unit}", "of the worst, from the conductor in space", "number"),
        (f"margin{unit}", "distance less limit; negative if too near", "number"),
        ("places", "places closer than the limit", "number"),
        ("trees", "trees that could fall on its conductors", "number"),
        (f"worst RMSE{unit}", "largest RMSE of its conductors", "number"),
        ("conductors", "conductors, without earth wires", "number"),
        ("line", "number of the line that it belongs to; 0 for cables of no line", "number"),
        ("order", "its place along the line, from 1", "number"),
        (f"length{unit}", "horizontal distance between its ends", "number"),
        ("ends", "what is known of its ends, where they are not at towers", "text"),
    ])  # fmt: skip


def span_rows(spans: Sequence[SpanFacts], units: LengthUnits) -> str:
    """The rows of the list."""
    return "\n".join(_row(one, units) for one in spans)


def _row(facts: SpanFacts, units: LengthUnits) -> str:
    span, worst = facts.span, facts.worst
    size = units.planar_m
    margin = None if worst is None else worst.margin
    cells = [
        ("" if worst is None else worst.kind, "text"),
        ("" if worst is None else f"{worst.distance / size:.2f}", "number"),
        ("" if margin is None else f"{margin / size:.2f}", "number"),
        (str(len(facts.dangers)), "number"),
        (str(len(facts.trees)), "number"),
        (f"{span.worst_rmse / size:.3f}", "number"),
        (str(span.conductors), "number"),
        (str(span.line), "number"),
        (str(span.order), "number"),
        (f"{span.length / size:.1f}", "number"),
        ("" if span.ends == BETWEEN else span.ends, "text"),
    ]
    return row("span", span.span_id, facts.state, NAMES[facts.state], cells)


def line_data(
    spans: Sequence[SpanFacts],
    profile: Sequence[ProfileStep],
    step: float,
    limits: ClearanceLimits | None,
    units: LengthUnits,
) -> dict[str, Any]:
    """What the script of the page needs of the line.

    Args:
        profile: what is nearest along the spans.
        step: m, of ``profile``.
        limits: None without a voltage.
    """
    steps: dict[int, list[ProfileStep]] = defaultdict(list)
    for each in profile:
        steps[each.span_id].append(each)
    return {
        "kinds": PICTURED,
        "step": step,
        "limits": {} if limits is None else {kind: limits.of(kind) for kind in KINDS},
        "spans": [_span(one, steps[one.span.span_id], step, units) for one in spans],
    }


def _span(
    facts: SpanFacts, steps: Sequence[ProfileStep], step: float, units: LengthUnits
) -> dict[str, Any]:
    span = facts.span
    frame = SpanFrame.between(np.array(span.start), np.array(span.end))
    clearance = facts.clearance
    return {
        "id": span.span_id,
        "line": span.line,
        "order": span.order,
        "ends": [round(part / units.planar_m, 2) for part in (*span.start, *span.end)],
        "from": span.from_tower,
        "to": span.to_tower,
        "length": round(span.length, 2),
        "angle": round(span.angle, 1),
        "known": span.ends,
        "measured": clearance is not None,
        "doubts": facts.doubts,
        "wires": [_wire(frame, conductor) for conductor in facts.conductors],
        "nearest": [_place(frame, place) for place in facts.nearest],
        "dangers": [_place(frame, place) for place in facts.dangers[:MOST_PLACES]],
        "more": max(len(facts.dangers) - MOST_PLACES, 0),
        "trees": [_tree(frame, tree) for tree in facts.trees[:MOST_PLACES]],
        "more_trees": max(len(facts.trees) - MOST_PLACES, 0),
        "along": _series(steps, step),
    }


def _at(frame: SpanFrame, *xyz: float) -> list[float]:
    """A place (x, y, z) m in the frame of a span: along it, to its left, and z."""
    return [round(part, 2) for part in frame.to_frame(np.array([xyz]))[0].tolist()]


def _wire(frame: SpanFrame, conductor: Conductor) -> list[Any]:
    """What ``wireOf`` of the script reads."""
    curve = conductor.catenary
    return [
        conductor.conductor_id, conductor.kind, conductor.subconductors,
        *_at(frame, *curve.start), *_at(frame, *curve.end), round(curve.parameter, 2),
        round(curve.blowout, 3), round(conductor.sag, 2), round(conductor.rmse, 3),
        round(conductor.seen, 2),
    ]  # fmt: skip


def _place(frame: SpanFrame, place: Clearance) -> list[Any]:
    """What ``placeOf`` of the script reads."""
    return [
        place.kind, round(place.distance, 2), round(place.vertical, 2), place.points, place.note,
        place.conductor_id, *_at(frame, place.x, place.y, place.z),
        *_at(frame, place.wire_x, place.wire_y, place.wire_z),
    ]  # fmt: skip


def _tree(frame: SpanFrame, tree: FallTree) -> list[Any]:
    """What ``treeOf`` of the script reads."""
    return [
        *_at(frame, tree.x, tree.y, tree.ground), round(tree.height, 2), round(tree.distance, 2),
        round(tree.margin, 2), tree.conductor_id,
    ]  # fmt: skip


def _series(steps: Sequence[ProfileStep], step: float) -> dict[str, list[float | None]]:
    """Kind -> smallest distance in m in each step along a span; None where nothing is near."""
    series: dict[str, dict[int, float]] = defaultdict(dict)
    for each in steps:
        series[each.kind][round(each.start / step)] = round(each.distance, 2)
    return {
        kind: [known.get(number) for number in range(max(known) + 1)]
        for kind, known in series.items()
    }


def span_picture(picture: SpanPicture) -> str:
    """The points of a span, where the script of the page finds them."""
    along, low = picture.origin
    return (
        f'<script type="text/plain" id="span-points-{picture.span_id}" '
        f'data-counts="{" ".join(map(str, picture.counts))}" data-step="{picture.step:.6g}" '
        f'data-along="{along:.2f}" data-low="{low:.2f}" data-beside="{picture.half_width:.2f}">'
        f"{picture.packed()}</script>"
    )
