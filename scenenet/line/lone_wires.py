"""Wires without a tower at both ends: they leave the survey, lead to a tower that was not found, or
belong to another line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from scenenet.line.catenary import Catenary
from scenenet.line.frame import SpanFrame
from scenenet.line.trace import GAP_M as LONG_GAP_M
from scenenet.line.trace import TAUTEST_M
from scenenet.line.traced_spans import REACH_M, LineTower, SpanWire, TracedSpan, traced
from scenenet.line.wire_points import WirePoints

MIN_ALONE_M, MIN_HELD_M = 25.0, 15.0
"""m, length of a wire without a tower, and of one with one, at least. One as long as the first
shows its curvature: the jib of a crane is straighter than any wire."""

WORST_ALONE_M = 0.08
"""m, greatest root mean square distance of its points from its catenary."""

SEEN_ALONE = 0.75
"""Share of its length on which it must be seen."""

UNSEEN_M, PAST_M = 40.0, 6.0
"""m from the end of a wire to the tower that it leads to, at most, and m that it may reach past
the axis of the tower."""

LINKED_M, GAP_M = 8.0, 40.0
"""m, gap in a wire that is bridged before it is known where it leads, and after."""

HIDDEN = 0.7
"""Share of a wire that may be hidden where another one passes along it, as between two towers."""

PARALLEL = 12.0
"""Degrees, up to which two stretches of wires that leave a tower are one span: over 20 m, wires
that are attached 4 m apart at one end and together at the other differ by so much."""

LOOKED_AT_M = 4.0
"""m from the axis of a stretch in which all points were looked at."""


def lone_spans(
    points: WirePoints, free: np.ndarray, towers: Sequence[LineTower]
) -> list[TracedSpan]:
    """Spans that end in the air, at one end or at both."""
    found: list[TracedSpan] = []
    left = free & points.certain
    while True:
        stretch = _straightest(points.xyz, left)
        if stretch is None:
            return _joined(found)
        parts = _parts(stretch, towers)
        frame = next((p for p in parts if left[points.beside(p, LOOKED_AT_M)].any()), None)
        if frame is None:  # the points lie at its ends
            left[points.beside(stretch, LOOKED_AT_M, beyond=LOOKED_AT_M)] = False
            continue
        rows = points.beside(frame, REACH_M, beyond=PAST_M)
        rows = rows[free[rows] & points.certain[rows]]
        wires = _wires(points, rows, frame)
        for wire in wires:
            left[wire.rows] = free[wire.rows] = False
        # What is near the axis and on no wire is looked at once.
        near = points.beside(frame, LOOKED_AT_M)
        left[near] = False
        found += spans_by_towers(wires, towers)


def _wires(points: WirePoints, rows: np.ndarray, frame: SpanFrame) -> list[SpanWire]:
    """The wires of a stretch.

    Where one of them is seen well the span is known to go on, so that another one, such as an earth
    wire of few points, may be hidden over as much of it as between two towers.
    """
    seen = [wire for wire in traced(points, rows, frame) if _is_good(wire) and is_wire(wire)]
    longest = max((wire.catenary.length for wire in seen), default=0.0)
    if all(wire.catenary.length > longest - LONG_GAP_M for wire in seen):
        return seen
    again = [
        wire
        for wire in traced(points, rows, frame, gap=max(LONG_GAP_M, HIDDEN * longest))
        if _is_good(wire) and (is_wire(wire) or any(_passes_along(by, wire) for by in seen))
    ]
    return max(seen, again, key=lambda wires: sum(wire.catenary.length for wire in wires))


def _is_good(wire: SpanWire) -> bool:
    """Whether a wire is long and near enough to its points."""
    return wire.catenary.length >= MIN_HELD_M and wire.rmse <= WORST_ALONE_M


def _passes_along(wire: SpanWire, other: SpanWire) -> bool:
    """Whether a wire passes along all of another one, which hangs as wires do."""
    curve = other.catenary
    s, _ = wire.catenary.along(np.array([curve.start, curve.end]))
    within = s.min() >= -PAST_M and s.max() <= wire.catenary.length + PAST_M
    return bool(within) and curve.parameter <= TAUTEST_M


def is_wire(wire: SpanWire) -> bool:
    """Whether what hangs at one tower at most is a wire: seen well, and no straighter than wires
    are, if it is long enough to show that."""
    curve = wire.catenary
    hangs = curve.parameter <= TAUTEST_M or curve.length < MIN_ALONE_M
    return hangs and wire.covered >= SEEN_ALONE


def _straightest(xyz: np.ndarray, left: np.ndarray) -> SpanFrame | None:
    """The longest straight stretch in plan among the points that are left, or None if none is
    ``MIN_HELD_M`` long. ``left`` loses points that belong to no stretch."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    while left.any():
        rows = np.flatnonzero(left)
        cells, of = np.unique(np.floor(xyz[rows, :2]).astype(np.int64), axis=0, return_inverse=True)
        pairs = cKDTree(cells).query_pairs(LINKED_M, output_type="ndarray")
        links = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(cells),) * 2)
        label = connected_components(links, directed=False)[1]
        sizes = np.bincount(label)
        small = sizes < MIN_HELD_M / 2
        left[rows[small[label[of.ravel()]]]] = False
        if small.all():
            return None
        largest = int(np.argmax(sizes))
        frame = _axis(cells[label == largest] + 0.5)
        if frame is not None:
            return frame
        left[rows[label[of.ravel()] == largest]] = False
    return None


def _axis(places: np.ndarray) -> SpanFrame | None:
    """The straight line with most of the places (n, 2) m, in cells of a metre, within 1.5 m."""
    middle = places.mean(axis=0)
    best, most = None, 0
    for angle in np.arange(0.0, np.pi, np.pi / 180):
        direction = np.array([np.cos(angle), np.sin(angle)])
        east, north = (places - middle).T
        t = north * direction[0] - east * direction[1]
        lanes = np.floor(t / 3.0)
        first = lanes.min()
        counts = np.bincount((lanes - first).astype(np.int64))
        if counts.max() > most:
            most = int(counts.max())
            best = direction, (first + np.argmax(counts) + 0.5) * 3.0
    assert best is not None
    direction, across = best
    east, north = (places - middle).T
    near = np.abs(north * direction[0] - east * direction[1] - across) <= 3.0
    s = np.sort((places[near] - middle) @ direction)
    breaks = np.flatnonzero(np.diff(s) > GAP_M)
    starts, stops = np.append(0, breaks + 1), np.append(breaks, len(s) - 1)
    run = int(np.argmax(s[stops] - s[starts]))
    low, high = s[starts[run]], s[stops[run]]
    if high - low < MIN_HELD_M:
        return None
    on_axis = middle + across * np.array([-direction[1], direction[0]])
    start = on_axis + low * direction
    return SpanFrame(float(start[0]), float(start[1]), direction, float(high - low))


def _parts(frame: SpanFrame, towers: Sequence[LineTower]) -> list[SpanFrame]:
    """The parts of a stretch between towers, where wires bend; the longest first."""
    cuts = [0.0, frame.length]
    for tower in towers:
        s, t = frame.to_frame(np.array([[tower.x, tower.y, 0.0]]))[0, :2].tolist()
        if PAST_M < s < frame.length - PAST_M and abs(t) <= REACH_M / 2:
            cuts.append(s)
    parts = []
    for low, high in pairwise(sorted(cuts)):
        x, y, _ = frame.to_map(np.array([[low, 0.0, 0.0]]))[0].tolist()
        parts.append(SpanFrame(x, y, frame.direction, high - low))
    return sorted(parts, key=lambda part: -part.length)


def spans_by_towers(wires: Sequence[SpanWire], towers: Sequence[LineTower]) -> list[TracedSpan]:
    """The wires of a stretch by the towers at their ends, without short ones that none holds."""
    groups: dict[tuple[int, int], list[tuple[SpanWire, LineTower | None, LineTower | None]]] = {}
    for wire in wires:
        catenary = wire.catenary
        first = _tower_at(catenary, towers, at_end=False)
        last = _tower_at(catenary, towers, at_end=True)
        if first is not None and first is last:
            first = last = None
        reach = [0.0, catenary.length]
        for number, tower in enumerate((first, last)):
            if tower is not None:
                reach[number] = float(catenary.along(tower.place[None])[0][0])
        if first is None and last is None and catenary.length < MIN_ALONE_M:
            continue
        wire = wire.between(*reach)
        key = (0 if first is None else first.id, 0 if last is None else last.id)
        groups.setdefault(key, []).append((wire, first, last))
    spans = []
    for members in groups.values():
        _, first, last = members[0]
        longest = max((wire.catenary for wire, _, _ in members), key=lambda c: c.length)
        start = longest.start[:2] if first is None else first.place
        end = longest.end[:2] if last is None else last.place
        frame = SpanFrame.between(np.array(start), np.array(end))
        spans.append(TracedSpan(first, last, frame, tuple(wire for wire, _, _ in members)))
    return spans


def _joined(spans: Sequence[TracedSpan]) -> list[TracedSpan]:
    """The spans; those that leave a tower in one direction are one, though their wires may have
    been found in different stretches."""
    found: list[TracedSpan] = []
    for span in spans:
        for number, other in enumerate(found):
            if _leave_together(span, other):
                longer = max(span, other, key=lambda each: each.frame.length)
                found[number] = replace(longer, wires=(*other.wires, *span.wires))
                break
        else:
            found.append(span)
    return found


def _leave_together(one: TracedSpan, other: TracedSpan) -> bool:
    """Whether two spans leave the same tower in about the same direction, and both end in the
    air."""
    for held, free in (("start", "end"), ("end", "start")):
        tower = getattr(one, held)
        if tower is None or tower is not getattr(other, held):
            continue
        in_the_air = getattr(one, free) is None and getattr(other, free) is None
        turn = one.frame.direction @ other.frame.direction
        if in_the_air and turn >= np.cos(np.radians(PARALLEL)):
            return True
    return False


def _tower_at(catenary: Catenary, towers: Sequence[LineTower], *, at_end: bool) -> LineTower | None:
    """The nearest tower that can hold a wire at one of its ends."""
    nearest, least = None, UNSEEN_M
    for tower in towers:
        s, t = (float(value[0]) for value in catenary.along(tower.place[None]))
        beyond = s - catenary.length if at_end else -s
        near = -PAST_M <= beyond <= least and abs(t) <= REACH_M
        if near and tower.holds(float(catenary.height(np.array([s]))[0])):
            nearest, least = tower, max(beyond, 0.0)
    return nearest
