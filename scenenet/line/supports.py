"""Towers as the line shows them: at how many heights they hold conductors, and what stands there.

The arrangement of the conductors distinguishes types of towers that a list of places does not:
one level is a horizontal arrangement, such as that of a portal or a window tower, two levels of one
and two conductors are a triangle, three levels of two are a double circuit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from scenenet.line.records import Conductor, LineSpan, Support
from scenenet.line.traced_spans import LineTower

LEVEL_M = 1.2
"""m, difference of heights above which attachments are on different crossarms. Insulators of one
crossarm, and the two sides of a tower on a slope, differ by less."""

POLE_M = 1.0
"""m, width at half its height below which a body is a pole."""


def supports(
    towers: Sequence[LineTower], spans: Sequence[LineSpan], conductors: Sequence[Conductor]
) -> list[Support]:
    """What each tower holds that is in a line, in the order of the towers.

    A tower is described by the span at it that has most conductors: in the other ones some may be
    missing.
    """
    at: dict[int, list[LineSpan]] = {}
    for span in spans:
        for end in {span.from_tower, span.to_tower} - {0}:
            if span.line:
                at.setdefault(end, []).append(span)
    by_span: dict[int, list[Conductor]] = {}
    for conductor in conductors:
        by_span.setdefault(conductor.span_id, []).append(conductor)
    return [_support(tower, at[tower.id], by_span) for tower in towers if tower.id in at]


def _support(
    tower: LineTower, spans: Sequence[LineSpan], by_span: Mapping[int, Sequence[Conductor]]
) -> Support:
    fullest = max(spans, key=lambda span: (span.conductors, span.earth_wires))
    heights = [
        each.from_height if fullest.from_tower == tower.id else each.to_height
        for each in by_span[fullest.span_id]
        if each.kind == "conductor"
    ]
    levels = _levels(np.array(heights))
    return Support(
        x=tower.x, y=tower.y, tower=tower.id, line=fullest.line, spans=len(spans),
        conductors=fullest.conductors, earth_wires=fullest.earth_wires,
        levels="+".join(str(len(level)) for level in levels),
        lowest=min(heights, default=0.0), highest=max(heights, default=0.0),
        body="" if tower.width is None else "pole" if tower.width < POLE_M else "lattice",
    )  # fmt: skip


def _levels(heights: np.ndarray) -> list[np.ndarray]:
    """Heights (n,) m by crossarm, the highest first."""
    if not len(heights):
        return []
    falling = np.sort(heights)[::-1]
    return np.split(falling, np.flatnonzero(-np.diff(falling) > LEVEL_M) + 1)
