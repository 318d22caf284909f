"""Towers, wires and spans as the search for spans knows them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from scenenet.line.catenary import Catenary
from scenenet.line.frame import SpanFrame
from scenenet.line.trace import GAP_M, TAUTEST_M, Wire, trace_wires
from scenenet.line.wire_points import WirePoints

REACH_M = 16.0
"""m, distance from the axis of a tower up to which wires are attached to it: the crossarms of the
widest pylons of single lines."""

LOWEST_M, ABOVE_TOP_M = 3.0, 3.0
"""m above the foot of a tower at which a wire is attached at least, and above its top at most: the
measured top may be that of the body."""

BELOW_M, ABOVE_M = 6.0, 15.0
"""m below and above a wire in which points that are not certain may be on the other wires of its
span."""

MIN_POINTS = 12
"""Points of a wire, at least."""

WORST_M = 0.12
"""m, greatest root mean square distance of the points of a wire from its catenary. Leaves within
the tube of a wire are about 0.17 m from it; a scanner measures to 0.05 m."""

FREE, THICKEST_M = 0.1, 0.3
"""Points in the ring around a wire for each point on it, up to which it hangs in free air, and m,
greatest root mean square distance there: no leaves are so far apart from all others, but noise may
hide that a bundle has several wires. A bundle of four is 0.28 m wide."""

STEEP = 0.4
"""m per metre, rise of a span from which its wires are looked for among uncertain points too, where
the certain ones show none: observers know wires that are nearly level."""

LONG_M = 150.0
"""m, length from which the points of a wire say for certain that it is too straight."""


@dataclass(frozen=True)
class LineTower:
    """What the line knows of a tower.

    Attributes:
        id: in the tower list.
        x, y, base: m, its foot.
        height: m.
        width: m, of its body at half its height; None if it is not known.
        bearings: degrees clockwise from north, in which its surroundings show conductors.
    """

    id: int
    x: float
    y: float
    base: float
    height: float
    width: float | None = None
    bearings: tuple[float, ...] = ()

    @property
    def place(self) -> np.ndarray:
        """(2,) m."""
        return np.array([self.x, self.y])

    def holds(self, z: float) -> bool:
        """Whether a wire at an elevation in m can be attached to it."""
        return self.base + LOWEST_M <= z <= self.base + self.height + ABOVE_TOP_M


@dataclass(frozen=True)
class SpanWire:
    """A wire of a span.

    Attributes:
        catenary: m, between its attachments; at an end without a tower, to its last point.
        rmse: m, of its points.
        rows: rows of its points in ``WirePoints``.
        covered: share of its length on which it is seen.
        offsets: (k, 2) m, of the wires of its bundle to the left of the catenary and above it.
    """

    catenary: Catenary
    rmse: float
    rows: np.ndarray
    covered: float
    offsets: np.ndarray

    def between(self, first: float, last: float) -> SpanWire:
        """The same wire between other distances from its start, m. It is not seen beyond its
        ends."""
        seen = min(last, self.catenary.length) - max(first, 0.0)
        covered = self.covered * max(seen, 0.0) / (last - first)
        return replace(self, catenary=self.catenary.between(first, last), covered=covered)


@dataclass(frozen=True)
class TracedSpan:
    """Wires between the same two places.

    Attributes:
        start, end: the towers; None where the wires end in the air.
        frame: from start to end.
        wires: in the order in which they were found.
    """

    start: LineTower | None
    end: LineTower | None
    frame: SpanFrame
    wires: tuple[SpanWire, ...]

    def place(self, end: int) -> tuple[float, float]:
        """(x, y) m of its start, 0, or its end, 1."""
        x, y, _ = self.frame.to_map(np.array([[end * self.frame.length, 0.0, 0.0]]))[0].tolist()
        return x, y


def traced(
    points: WirePoints,
    rows: np.ndarray,
    frame: SpanFrame,
    rise: float = 0.0,
    gap: float = GAP_M,
    *,
    doubtful: bool = False,
) -> tuple[SpanWire, ...]:
    """The wires among some points, each between its first and its last point. Points that are not
    certain count where other wires of the span show that wires hang there, and in steep spans.

    The answer is kept: a line is searched once more with the towers that it asked for, and most of
    its spans stay the same.

    Args:
        rows: (n,) of the points.
        frame: of the span.
        rise, gap: of the span, as in ``trace_wires``.
        doubtful: whether points that are not certain count everywhere.
    """
    question = frame.x, frame.y, *frame.direction.tolist(), frame.length, rise, gap, doubtful
    key = hashlib.sha256(repr(question).encode() + rows.tobytes()).digest()
    if key not in points.answers:
        points.answers[key] = tuple(_traced(points, rows, frame, rise, gap, doubtful))
    return points.answers[key]


def _traced(
    points: WirePoints, rows: np.ndarray, frame: SpanFrame, rise: float, gap: float, doubtful: bool
) -> Iterator[SpanWire]:
    certain = points.certain[rows] | doubtful
    stz = frame.to_frame(points.xyz[rows])
    wires = trace_wires(stz[certain], rise, gap)
    number = np.flatnonzero(certain)
    if not wires and abs(rise) > STEEP:
        wires, number = trace_wires(stz, rise, gap), np.arange(len(stz))
    elif wires and not certain.all():
        above = np.array([wire.fit.catenary.residuals(stz)[1] for wire in wires])
        beside = ~certain & (above.max(axis=0) > -BELOW_M) & (above.min(axis=0) < ABOVE_M)
        number = np.flatnonzero(certain | beside)
        wires = trace_wires(stz[number], rise, gap)
    for wire in wires:
        catenary = wire.fit.catenary
        taut = catenary.parameter > TAUTEST_M and catenary.length > LONG_M
        worst = THICKEST_M if wire.crowd <= FREE else WORST_M
        if len(wire.rows) >= MIN_POINTS and wire.fit.rmse <= worst and not taut:
            yield _span_wire(wire, rows[number[wire.rows]], frame)


def _span_wire(wire: Wire, rows: np.ndarray, frame: SpanFrame) -> SpanWire:
    """The wire in map coordinates."""
    catenary = wire.fit.catenary
    start, end = frame.to_map(np.array([catenary.start, catenary.end]))
    on_map = Catenary.of(start, end, catenary.parameter, catenary.blowout)
    return SpanWire(on_map, wire.fit.rmse, rows, wire.covered, wire.offsets)
