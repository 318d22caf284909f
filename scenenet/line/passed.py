"""Towers that the line contradicts: conductors pass them without a bend.

Between its supports a conductor is one catenary. Where a tree amid the conductors is taken for a
tower, they are traced from both sides up to it, and what meets there is the same smooth curve. Over
whole spans this shows where the conductors near the axis (``scenenet.detection.bends``) do not: a
crown may hide them on one side, and a tower nearby bends them within the reach of that test.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from scenenet.detection.conductor_rules import BEND_WIRE_M, OPPOSITE, POLE_M
from scenenet.line.records import Conductor
from scenenet.line.traced_spans import LineTower

PASSED = 0.005
"""Half the change of slope, or of direction, m per m, up to which conductors pass. The fits of
whole spans show it to less than 0.001. ``BEND``, for the few metres near an axis, is more: towers
in a dip bend conductors less than others."""

MEETS_M = 2 * BEND_WIRE_M
"""m, distance of the ends of one conductor at a tower, cut at the plane of its crossarms."""

ARM = 0.5
"""Share of its height beyond which a pole holds no conductor: its crossarms, if any, are shorter.
What is as slim as a pole amid wider lines is a tree."""


class _End(NamedTuple):
    """The end of a conductor at a tower.

    Attributes:
        span: number of its span.
        xyz: (3,) m.
        way: (2,) horizontal unit vector away from the tower.
        rise: m per m in this direction.
    """

    span: int
    xyz: np.ndarray
    way: np.ndarray
    rise: float


def passed_towers(towers: Sequence[LineTower], conductors: Sequence[Conductor]) -> set[int]:
    """Ids of the towers that conductors pass without a bend, as they pass a tree.

    A pole may be as slim as no tree is, and short spans bend little: in a dip, poles bend their
    conductors no more than a tree does. So they are none of them, unless they would hold conductors
    further away than ``ARM`` allows.

    Args:
        towers: of the survey.
        conductors: of its lines, m.
    """
    at: dict[int, list[_End]] = {tower.id: [] for tower in towers}
    for conductor in conductors:
        if conductor.kind != "cable":
            _add_ends(at, conductor)
    return {
        tower.id
        for tower in towers
        if (tower.width is None or tower.width > POLE_M or _too_far(tower, at[tower.id]))
        and max(_bends(at[tower.id]), default=np.inf) <= PASSED
    }


def _too_far(tower: LineTower, ends: Sequence[_End]) -> bool:
    """Whether a conductor ends further from a tower than a pole of its height holds one."""
    apart = (float(np.linalg.norm(end.xyz[:2] - tower.place)) for end in ends)
    return max(apart, default=0.0) > ARM * tower.height


def _add_ends(at: Mapping[int, list[_End]], conductor: Conductor) -> None:
    """Add the ends of a conductor to those at its towers."""
    curve = conductor.catenary
    left = np.array([-curve.direction[1], curve.direction[0]])
    blown = 4 * curve.blowout / curve.length * left
    start, end = curve.slope(np.array([0.0, curve.length])).tolist()
    for tower, xyz, way, rise in (
        (conductor.from_tower, curve.start, curve.direction + blown, start),
        (conductor.to_tower, curve.end, blown - curve.direction, -end),
    ):
        if tower in at:
            unit = way / np.linalg.norm(way)
            at[tower].append(_End(conductor.span_id, np.array(xyz), unit, rise))


def _bends(ends: Sequence[_End]) -> list[float]:
    """Half the change of slope, or of direction if that is more, m per m, of each conductor that
    continues at the other side of a tower."""
    bends = []
    for number, one in enumerate(ends):
        for other in ends[number + 1 :]:
            opposite = one.way @ other.way < np.cos(np.radians(OPPOSITE))
            if one.span == other.span or not opposite:
                continue
            if np.linalg.norm(one.xyz - other.xyz) <= MEETS_M:
                turn = np.linalg.norm(one.way + other.way)
                bends.append(max(abs(one.rise + other.rise), float(turn)) / 2)
    return bends
