"""Spans that a line lacks: its end faces another tower, and no span was traced between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scenenet.line.graph import STRAY
from scenenet.line.notes import UNTRACED, LineNote
from scenenet.line.records import LineSpan
from scenenet.line.spans import BETWEEN_M
from scenenet.line.traced_spans import LineTower

FACES = 60.0
"""Degrees, greatest turn of a line at both towers of a gap at which its two ends face each other.
Lines that end side by side, as at a substation, would turn by 90."""

AHEAD = 30.0
"""Degrees, the same where only one end of a line shows: most lines turn less, and beside them other
towers stand."""

LONGER = 1.5
"""Length of a gap over the longest span of its line, at most. What is longer is seldom one span."""


class Gap(NamedTuple):
    """Where a span is expected.

    Attributes:
        note: that says so.
        span_ids: of the spans that end there.
    """

    note: LineNote
    span_ids: frozenset[int]


@dataclass(frozen=True)
class _DeadEnd:
    """A tower from which a line does not go on.

    Attributes:
        tower: at which the line ends.
        span: that ends there.
        onward: (2,) unit vector in which the line would go straight on.
        reach: m, longest gap after it.
    """

    tower: LineTower
    span: LineSpan
    onward: np.ndarray
    reach: float

    def turn(self, place: np.ndarray) -> float:
        """Degrees by which the line would turn here to a place (2,) m."""
        way = place - self.tower.place
        length = float(np.linalg.norm(way))
        cosine = float(way @ self.onward) / length if length else 1.0
        return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def untraced_spans(towers: Sequence[LineTower], spans: Sequence[LineSpan]) -> list[Gap]:
    """The gaps in the lines; the place of each is its middle.

    Either both towers end a line and face each other, or one does, and the other tower stands ahead
    of it: the line may end there, or another one may pass.

    Args:
        towers: of the survey, m.
        spans: of its lines.
    """
    ends = {end.tower.id: end for end in _dead_ends(towers, spans)}
    noted: dict[frozenset[int], Gap] = {}
    for end in ends.values():
        best = min(
            (
                (mutual, float(np.linalg.norm(tower.place - end.tower.place)), tower)
                for tower in towers
                if (mutual := _follows(end, tower, ends.get(tower.id))) is not None
            ),
            key=lambda one: (not one[0], one[1], one[2].id),
            default=None,
        )
        if best is not None and not _divided(end.tower, best[2], towers):
            pair = frozenset({end.tower.id, best[2].id})
            noted.setdefault(pair, _gap(end, best[2], ends.get(best[2].id) if best[0] else None))
    return list(noted.values())


def _dead_ends(towers: Sequence[LineTower], spans: Sequence[LineSpan]) -> list[_DeadEnd]:
    """The towers from which a line does not go on, in the order of the spans."""
    by_id = {tower.id: tower for tower in towers}
    at: dict[int, list[LineSpan]] = {}
    longest: dict[int, float] = {}
    for span in spans:
        if span.line:
            longest[span.line] = max(longest.get(span.line, 0.0), span.length)
            for tower in {span.from_tower, span.to_tower} & by_id.keys():
                at.setdefault(tower, []).append(span)
    found = []
    for tower, own in at.items():
        enough = STRAY * max(span.conductors for span in own)
        full = [span for span in own if span.conductors >= enough]
        if len(full) == 1:
            [span] = full
            way = np.subtract(span.end, span.start) * (1 if span.to_tower == tower else -1)
            onward = way / np.linalg.norm(way)
            found.append(_DeadEnd(by_id[tower], span, onward, LONGER * longest[span.line]))
    return found


def _follows(end: _DeadEnd, tower: LineTower, other: _DeadEnd | None) -> bool | None:
    """Whether a tower may follow the end of a line: True if its line faces back, False if it only
    stands ahead, None if it does not follow.

    Args:
        other: the end of a line at this tower, if one ends there.
    """
    if tower.id in {end.span.from_tower, end.span.to_tower}:
        return None
    turn = end.turn(tower.place)
    reach = end.reach if other is None else max(end.reach, other.reach)
    if np.linalg.norm(tower.place - end.tower.place) > reach:
        return None
    if other is not None and turn <= FACES and other.turn(end.tower.place) <= FACES:
        return True
    return False if turn <= AHEAD else None


def _divided(first: LineTower, last: LineTower, towers: Sequence[LineTower]) -> bool:
    """Whether another tower stands on the way."""
    way = last.place - first.place
    length = float(np.linalg.norm(way))
    places = np.array([tower.place for tower in towers]) - first.place
    s = places @ way / length
    t = (places @ np.array([-way[1], way[0]])) / length
    return bool(((np.abs(t) <= BETWEEN_M) & (s > BETWEEN_M) & (s < length - BETWEEN_M)).any())


def _gap(end: _DeadEnd, tower: LineTower, other: _DeadEnd | None) -> Gap:
    x, y = ((end.tower.place + tower.place) / 2).tolist()
    note = LineNote(x, y, UNTRACED, end.tower.id, end.span.span_id, tower.id)
    return Gap(note, frozenset(e.span.span_id for e in (end, other) if e is not None))
