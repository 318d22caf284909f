"""The spans of a survey in order along their lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from scenenet.line.traced_spans import TracedSpan

SHARPEST = 100.0
"""Degrees, greatest change of direction of a line at a tower. Lines end or branch at a sharper
one."""


STRAY = 0.5
"""Share of the wires of the fullest span at a tower below which another one does not continue it: a
tower holds as many on both sides, and what is traced into the air amid trees is fewer."""


class Step(NamedTuple):
    """A span as a line runs through it.

    Attributes:
        number: of the span.
        turned: whether the line runs from its end to its start.
    """

    number: int
    turned: bool


@dataclass(frozen=True)
class Chain:
    """A line: spans that continue one another.

    Attributes:
        steps: in order.
        angles: degrees, change of direction after each span, to the right; 0 after the last.
    """

    steps: tuple[Step, ...]
    angles: tuple[float, ...]


def chains(spans: Sequence[TracedSpan]) -> list[Chain]:
    """The lines, each from its western end, the longest first.

    At a tower with several spans, those are joined first that have about as many wires, and among
    these those that turn least.
    """
    after = _joined(spans)
    left = set(range(len(spans)))
    found = []
    # From the ends first; what is left then are rings.
    ends = [(n, side) for n in sorted(left) for side in (0, 1) if (n, side) not in after]
    for number, side in [*ends, *((n, 0) for n in sorted(left))]:
        if number not in left:
            continue
        steps = []
        while number in left:
            left.remove(number)
            steps.append(Step(number, side == 1))
            following = after.get((number, 1 - side))
            if following is None:
                break
            number, side = following
        found.append(_chain(spans, steps))
    return sorted(found, key=lambda chain: (-_length(spans, chain), chain.steps[0].number))


def _joined(spans: Sequence[TracedSpan]) -> dict[tuple[int, int], tuple[int, int]]:
    """End of a span -> end of the span that continues it; 0 is the start, 1 the end."""
    at: dict[int, list[tuple[int, int]]] = {}
    for number, span in enumerate(spans):
        for side, tower in enumerate((span.start, span.end)):
            if tower is not None:
                at.setdefault(tower.id, []).append((number, side))
    pairs = []
    for ends in at.values():
        for k, one in enumerate(ends):
            for other in ends[k + 1 :]:
                turn = abs(_turn(-_away(spans, one), _away(spans, other)))
                if turn <= SHARPEST:
                    few, many = sorted(len(spans[n].wires) for n, _ in (one, other))
                    pairs.append((few < STRAY * many, turn, one, other))
    joined: dict[tuple[int, int], tuple[int, int]] = {}
    for _, _, one, other in sorted(pairs):
        if one not in joined and other not in joined:
            joined[one], joined[other] = other, one
    return joined


def _away(spans: Sequence[TracedSpan], end: tuple[int, int]) -> np.ndarray:
    """(2,) unit vector along a span, away from its end."""
    number, side = end
    return spans[number].frame.direction * (1 if side == 0 else -1)


def _turn(before: np.ndarray, after: np.ndarray) -> float:
    """Degrees, change of direction to the right."""
    cross = before[1] * after[0] - before[0] * after[1]
    return float(np.degrees(np.arctan2(cross, before @ after)))


def _chain(spans: Sequence[TracedSpan], steps: list[Step]) -> Chain:
    """The line through these spans, from its western end."""
    first, last = (
        _ends(spans, step)[end] for step, end in ((steps[0], 0), (steps[-1], 1))
    )  # fmt: skip
    if first.tolist() > last.tolist():
        steps = [Step(step.number, not step.turned) for step in reversed(steps)]
    ways = [spans[n].frame.direction * (-1 if turned else 1) for n, turned in steps]
    angles = [_turn(before, after) for before, after in pairwise(ways)]
    return Chain(tuple(steps), (*angles, 0.0))


def _ends(spans: Sequence[TracedSpan], step: Step) -> tuple[np.ndarray, np.ndarray]:
    frame = spans[step.number].frame
    start = np.array([frame.x, frame.y])
    end = start + frame.length * frame.direction
    return (end, start) if step.turned else (start, end)


def _length(spans: Sequence[TracedSpan], chain: Chain) -> float:
    return sum(spans[step.number].frame.length for step in chain.steps)
