"""Whether conductors bend at a tower, as they do where something carries them.

Between its supports a conductor is a smooth curve. A support holds it up, or holds it down in a
valley, or turns it; in each case the conductor has a bend there. Under a tree that stands amid the
conductors of a line, or beside them, they pass without one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scenenet.detection.conductor_rules import (
    BEND,
    BEND_WIRE_M,
    FAR,
    GAP,
    OPPOSITE,
)
from scenenet.detection.conductors import Span
from scenenet.detection.line_frame import across, unit

ROUNDS = 5
"""Number of times that the curves are fitted, each time with less weight for what is far off."""

NOISE_M = 0.05
"""m from a curve beyond which points count less; for a bundle, twice their median distance."""

FEWEST, SHORTEST_M = 5, 5.0
"""Smallest number of points that show a conductor, and m along it."""


class Wire(NamedTuple):
    """Points on a conductor on one side of an axis: s along the line, t to its right and z, (N,) m
    each, and (2,) m, t and z where it passes the axis."""

    s: np.ndarray
    t: np.ndarray
    z: np.ndarray
    at_axis: np.ndarray


def pass_without_bend(spans: tuple[Span, ...], axis: np.ndarray) -> bool:
    """Whether conductors pass an axis (2,) m from one side to the other as smooth curves.

    False if no conductor shows on both sides of the axis, so that it cannot be decided.
    """
    pair = _opposite(spans)
    if pair is None:
        return False
    along = unit(pair[0].bearing) - unit(pair[1].bearing)
    along /= np.linalg.norm(along)
    ahead, behind = (
        _wires(span, axis, along, sign) for span, sign in zip(pair, (1, -1), strict=True)
    )
    passing = [(wire, other) for wire in ahead if (other := _continuing(wire, behind))]
    if not passing:
        return False
    return max(abs(bend) for bend in _bends(passing)) <= BEND


def _opposite(spans: tuple[Span, ...]) -> tuple[Span, Span] | None:
    """The longest span, and the longest of those on the other side of the tower."""
    for other in spans[1:]:
        if unit(spans[0].bearing) @ unit(other.bearing) < np.cos(np.radians(OPPOSITE)):
            return spans[0], other
    return None


def _wires(span: Span, axis: np.ndarray, along: np.ndarray, sign: int) -> list[Wire]:
    """The conductors of a span, each by itself.

    Args:
        axis: (2,) m.
        along: (2,) unit vector along the line.
        sign: 1 if the span leaves in this direction, -1 in the other.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    offset = span.places[:, :2] - axis
    s, t, z = offset @ along, offset @ across(along), span.places[:, 2]
    s, t, z = (values[np.abs(s) <= FAR] for values in (s, t, z))
    level = z - sign * span.slope * s
    near = np.column_stack([s / (1.5 * GAP), t / BEND_WIRE_M, level / BEND_WIRE_M])
    one, other = cKDTree(near).query_pairs(1.0, output_type="ndarray").T
    joined = coo_array((np.ones(len(one)), (one, other)), shape=(len(s), len(s)))
    number, wire_of = connected_components(joined, directed=False)
    wires = []
    for wire in range(number):
        rows = np.flatnonzero(wire_of == wire)
        if len(rows) < FEWEST or np.ptp(s[rows]) < SHORTEST_M:
            continue
        line = np.column_stack([np.ones(len(rows)), s[rows]])
        passes = np.linalg.lstsq(line, np.column_stack([t[rows], z[rows]]), rcond=None)[0][0]
        wires.append(Wire(s[rows], t[rows], z[rows], passes))
    return wires


def _continuing(wire: Wire, others: list[Wire]) -> Wire | None:
    """The conductor among ``others``, on the other side of the axis, that continues this one."""
    away = [float(np.hypot(*(wire.at_axis - other.at_axis))) for other in others]
    nearest = int(np.argmin(away)) if away else 0
    return others[nearest] if away and away[nearest] <= 2 * BEND_WIRE_M else None


def _bends(passing: list[tuple[Wire, Wire]]) -> tuple[float, float]:
    """Half the change of slope, and of direction, of the conductors at the axis: m per m.

    Each conductor is a straight line, all have one curvature and one bend in common.
    """
    n = len(passing)
    rows, t, z, of_pair = [], [], [], []
    for i, pair in enumerate(passing):
        for wire in pair:
            design = np.zeros((len(wire.s), 2 * n + 2))
            design[:, 2 * i], design[:, 2 * i + 1] = 1, wire.s
            design[:, -2], design[:, -1] = wire.s**2, np.abs(wire.s)
            rows.append(design)
            t.append(wire.t)
            z.append(wire.z)
            of_pair.append(np.full(len(wire.s), i))
    design, which = np.concatenate(rows), np.concatenate(of_pair)
    # Seen from above a conductor is straight.
    straight = np.delete(design, -2, axis=1)
    return _last(design, np.concatenate(z), which), _last(straight, np.concatenate(t), which)


def _last(design: np.ndarray, values: np.ndarray, which: np.ndarray) -> float:
    """The last coefficient of a robust fit of ``values`` (N,) by ``design`` (N, K).

    The wires of a bundle are a few decimetres apart. If points of one of them counted less, the fit
    would follow one wire on one side of the axis and another on the other, as if the bundle turned.

    Args:
        which: (N,) number of the conductor of each value.
    """
    fit = np.linalg.lstsq(design, values, rcond=None)[0]
    off = np.abs(values - design @ fit)
    wide = [2 * np.median(off[which == wire]) for wire in range(which.max() + 1)]
    noise = np.maximum(wide, NOISE_M)[which]
    for _ in range(ROUNDS - 1):
        weight = 1 / np.sqrt(1 + (off / noise) ** 2)
        fit = np.linalg.lstsq(design * weight[:, None], values * weight, rcond=None)[0]
        off = np.abs(values - design @ fit)
    return float(fit[-1])
