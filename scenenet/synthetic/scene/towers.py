"""Towers as members (bars, tubes, strings), and points on members.

In the frame of a tower x is along the cross-arms, y along the line, z up; the origin is the centre
of the foot. To add a kind of tower, write a function (height, circuits, earth_wires, size) ->
Structure, add it to ``KINDS`` and its name to ``settings.Kind``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

BELOW_GROUND_M = 1.5
"""Length of the legs below the foot, so that none ends in the air on a slope, m."""

EARTH_WIRES_APART_M = 1.2
"""Half the distance between two earth wires, m."""

CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))
"""Signs of x and y at the corners of a square, in order."""


@dataclass(frozen=True)
class Structure:
    """A tower in its frame.

    Attributes:
        members: (M, 8): both ends (x, y, z, x, y, z; m) and the radius at each end (m).
        attachments: (W, 3), m: where wires are attached. The conductors of a circuit from left to
            right (two circuits: left side upwards, then right side), then the earth wires.
        half_base: half the side of the foot, m.
        insulators: rows of the members that are insulators, one for each conductor in the order of
            the attachments: from the tower to the attachment.
    """

    members: np.ndarray
    attachments: np.ndarray
    half_base: float
    insulators: tuple[int, ...]


class Size(NamedTuple):
    """Prescribed lengths of a tower, m; None leaves the length to its kind.

    Attributes:
        width: of the body, the same from foot to head: side of a lattice, diameter of a pole,
            distance between the poles of an H-frame.
        reach: of the longest cross-arm from the axis; the others keep their share of it.
    """

    width: float | None = None
    reach: float | None = None

    def reach_or(self, length: float) -> float:
        """The reach, or that of a kind in which it is ``length``."""
        return length if self.reach is None else self.reach


OF_ITS_KIND = Size()
"""A tower with the lengths of its kind."""


class _Frame:
    """Collects the members of a tower."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, ...]] = []
        self._insulators: list[int] = []

    def bar(self, a: tuple, b: tuple, radius: float, end_radius: float | None = None) -> None:
        self._rows.append((*a, *b, radius, radius if end_radius is None else end_radius))

    def insulator(self, a: tuple, b: tuple, radius: float) -> None:
        self._insulators.append(len(self._rows))
        self.bar(a, b, radius)

    def structure(self, attachments: list[tuple], half_base: float) -> Structure:
        """The tower of the members."""
        members = np.asarray(self._rows, dtype=np.float64)
        return Structure(members, np.asarray(attachments), half_base, tuple(self._insulators))


def _lattice_body(
    frame: _Frame, levels: np.ndarray, halves: np.ndarray, leg: float, brace: float
) -> None:
    """Four legs and X-braced faces: a square of half side ``halves[k]`` at height ``levels[k]``."""
    for k in range(len(levels) - 1):
        z0, z1, h0, h1 = levels[k], levels[k + 1], halves[k], halves[k + 1]
        for (ax, ay), (bx, by) in zip(CORNERS, (*CORNERS[1:], CORNERS[0]), strict=True):
            frame.bar((ax * h0, ay * h0, z0), (ax * h1, ay * h1, z1), leg)
            if z0 >= 0:
                frame.bar((ax * h0, ay * h0, z0), (bx * h1, by * h1, z1), brace)
                frame.bar((bx * h0, by * h0, z0), (ax * h1, ay * h1, z1), brace)
                frame.bar((ax * h1, ay * h1, z1), (bx * h1, by * h1, z1), brace)


def _truss_arm(frame: _Frame, reach: float, z: float, half: float, depth: float) -> None:
    """A cross-arm from the body to its tip at (reach, 0, z); the sign of reach is the side."""
    side = np.sign(reach)
    tip = (reach, 0.0, z)
    for y in (-half, half):
        frame.bar((side * half, y, z), tip, 0.04)
        frame.bar((side * half, y, z + depth), tip, 0.04)
    for share in (0.3, 0.6):
        x = side * half + share * (reach - side * half)
        y = half * (1 - share)
        frame.bar((x, -y, z), (x, y, z), 0.03)
        frame.bar((x, -y, z), (x, -y, z + depth * (1 - share)), 0.03)
        frame.bar((x, y, z), (x, y, z + depth * (1 - share)), 0.03)


def _hang(
    frame: _Frame, points: list[tuple[float, float, float]], length: float
) -> list[tuple[float, float, float]]:
    """Insulator strings below ``points``; returns their lower ends."""
    ends = [(x, y, z - length) for x, y, z in points]
    for point, end in zip(points, ends, strict=True):
        frame.insulator(point, end, 0.07)
    return ends


def _earth(frame: _Frame, height: float, earth_wires: int) -> list[tuple[float, float, float]]:
    """Attachments of the earth wires: the top, or both ends of a beam there."""
    if earth_wires < 2:
        return [(0.0, 0.0, height)] * earth_wires
    apart = EARTH_WIRES_APART_M
    frame.bar((-apart, 0, height), (apart, 0, height), 0.06)
    return [(-apart, 0.0, height), (apart, 0.0, height)]


def _pole_head(
    frame: _Frame, height: float, circuits: int, earth_wires: int, reach: float, drop: float
) -> list[tuple[float, float, float]]:
    """Cross-arms of a pole: a triangle for one circuit, three levels for two."""
    top = height - (1.0 if earth_wires else 0.0)
    # Pins or short strings: the lower conductors are just above their arm.
    pin = 0.2
    if circuits == 1:
        arm = top - drop
        frame.bar((-reach, 0, arm), (reach, 0, arm), 0.07)
        ends = [(-reach, 0.0, arm), (0.0, 0.0, top - pin), (reach, 0.0, arm)]
    else:
        storeys = [top - 2 * drop - 0.3, top - drop - 0.3, top - 0.3]
        for z in storeys:
            frame.bar((-reach, 0, z), (reach, 0, z), 0.07)
        ends = [(side * reach, 0.0, z) for side in (-1, 1) for z in storeys]
    for x, y, z in ends:
        frame.insulator((x, y, z), (x, y, z + pin), 0.06)
    points = [(x, y, z + pin) for x, y, z in ends]
    return points + _earth(frame, height, earth_wires)


def lattice(height: float, circuits: int, earth_wires: int, size: Size = OF_ITS_KIND) -> Structure:
    """A pylon on a square pyramid (thesis 5.1.2: base 4.15 m at 34.7 m) with truss cross-arms."""
    frame = _Frame()
    base, waist, shoulder = 0.06 * height, 0.024 * height, 0.016 * height
    if size.width is not None:
        base = waist = shoulder = size.width / 2
    peak = 0.94 * height
    panels = max(4, round(height / 3.5))
    # Panels become shorter upwards, like the width of the body.
    levels = peak * (1 - (1 - np.linspace(0, 1, panels + 1)) ** 1.25)
    waist_z = 0.65 * height
    halves = np.interp(levels, [0, waist_z, peak], [base, waist, shoulder])
    leg, brace = 0.06, 0.035
    below = base + (base - waist) / waist_z * BELOW_GROUND_M
    _lattice_body(frame, np.r_[-BELOW_GROUND_M, levels], np.r_[below, halves], leg, brace)
    for sx, sy in CORNERS:
        frame.bar((sx * shoulder, sy * shoulder, peak), (0, 0, height), 0.04)
    if circuits == 1:
        arms = [(-0.12, 0.74), (0.11, 0.86), (0.12, 0.74)]
    else:
        storeys = [(0.11, 0.66), (0.14, 0.77), (0.1, 0.88)]
        arms = [(side * reach, z) for side in (-1, 1) for reach, z in storeys]
    longest = max(abs(reach) for reach, _ in arms)
    scale = size.reach_or(longest * height) / longest
    tips = []
    for reach, share in arms:
        z = share * height
        half = float(np.interp(z, levels, halves))
        _truss_arm(frame, reach * scale, z, half, 0.035 * height)
        tips.append((reach * scale, 0.0, z))
    points = _hang(frame, tips, min(2.0, 0.045 * height))
    points += _earth(frame, height, earth_wires)
    return frame.structure(points, base)


def lattice_pole(
    height: float, circuits: int, earth_wires: int, size: Size = OF_ITS_KIND
) -> Structure:
    """A slender braced column, 0.7 m wide at the foot, as used for medium-voltage lines."""
    frame = _Frame()
    levels = np.linspace(0, height, max(6, round(height / 1.3)) + 1)
    foot, top = (0.35, 0.17) if size.width is None else (size.width / 2, size.width / 2)
    halves = np.linspace(foot, top, len(levels))
    _lattice_body(
        frame, np.r_[-BELOW_GROUND_M, levels], np.r_[halves[0], halves], leg=0.035, brace=0.012
    )
    points = _pole_head(frame, height, circuits, earth_wires, size.reach_or(1.02), drop=1.62)
    return frame.structure(points, foot)


def tubular(height: float, circuits: int, earth_wires: int, size: Size = OF_ITS_KIND) -> Structure:
    """A tapered steel or concrete pole."""
    frame = _Frame()
    foot, top = (0.013 * height, 0.12) if size.width is None else (size.width / 2, size.width / 2)
    frame.bar((0, 0, -BELOW_GROUND_M), (0, 0, height), foot, top)
    points = _pole_head(frame, height, circuits, earth_wires, size.reach_or(0.98), drop=1.62)
    return frame.structure(points, max(0.3, top))


def wooden(height: float, circuits: int, earth_wires: int, size: Size = OF_ITS_KIND) -> Structure:
    """A wooden pole with a wooden cross-arm and its two struts."""
    frame = _Frame()
    foot, top = (0.17, 0.11) if size.width is None else (size.width / 2, size.width / 2)
    frame.bar((0, 0, -BELOW_GROUND_M), (0, 0, height), foot, top)
    reach = size.reach_or(1.1)
    points = _pole_head(frame, height, circuits, earth_wires, reach, drop=1.55)
    arm = points[0][2] - 0.2
    for side in (-1, 1):
        frame.bar((0, 0, arm - 0.9), (side * min(0.9, reach), 0, arm), 0.05)
    return frame.structure(points, max(0.2, top))


def h_frame(height: float, circuits: int, earth_wires: int, size: Size = OF_ITS_KIND) -> Structure:
    """Two poles, a beam across them and an X between them; conductors at one level."""
    frame = _Frame()
    half, beam = 0.1 * height if size.width is None else size.width / 2, height - 0.8
    for side in (-1, 1):
        frame.bar((side * half, 0, -BELOW_GROUND_M), (side * half, 0, height), 0.19, 0.12)
        frame.bar((side * half, 0, 0.55 * height), (-side * half, 0, 0.8 * height), 0.05)
    reach = size.reach_or(2.0 * half)
    frame.bar((-reach, 0, beam), (reach, 0, beam), 0.1)
    shares = (-1.0, 0.0, 1.0) if circuits == 1 else (-1.0, -0.65, -0.3, 0.3, 0.65, 1.0)
    points = _hang(frame, [(share * reach, 0.0, beam) for share in shares], 0.6)
    points += [(side * half, 0.0, height) for side in (1, -1)[:earth_wires]]
    return frame.structure(points, half)


def window(height: float, circuits: int, earth_wires: int, size: Size = OF_ITS_KIND) -> Structure:
    """A pylon whose body divides into two legs below a beam; a conductor passes between them.

    Conductors are at one level, on both sides and in the window. Earth wires are on the legs.
    """
    frame = _Frame()
    base, waist = (0.11 * height, 0.066 * height) if size.width is None else (size.width / 2,) * 2
    fork, beam, reach = 0.42 * height, 0.7 * height, size.reach_or(0.36 * height)
    levels = np.linspace(0, fork, max(4, round(fork / 2.5)) + 1)
    halves = np.interp(levels, [0, fork], [base, waist])
    _lattice_body(frame, np.r_[-BELOW_GROUND_M, levels], np.r_[base, halves], leg=0.06, brace=0.035)
    apart, thick = 0.6 * reach, 0.3 * waist
    z = np.linspace(fork, height, max(4, round((height - fork) / 2)) + 1)
    aside = np.interp(z, [fork, beam, height], [waist - thick, apart, apart])
    for side in (-1, 1):
        _leg(frame, side * aside, z, thick)
    for y in (-thick, thick):
        for x in np.linspace(-reach, 0.8 * reach, 10):
            step = 0.2 * reach
            frame.bar((x, y, beam), (x + step, y, beam), 0.05)
            frame.bar((x, y, beam), (x + step, y, beam + 2 * thick), 0.03)
            frame.bar((x, y, beam + 2 * thick), (x + step, y, beam + 2 * thick), 0.05)
    shares = (-1.0, 0.0, 1.0) if circuits == 1 else (-1.0, -0.75, -0.2, 0.2, 0.75, 1.0)
    points = _hang(frame, [(share * reach, 0.0, beam) for share in shares], 0.08 * height)
    points += [(side * apart, 0.0, height) for side in (1, -1)[:earth_wires]]
    return frame.structure(points, base)


def _leg(frame: _Frame, middles: np.ndarray, z: np.ndarray, half: float) -> None:
    """A leg of a window: four bars with a brace on two sides, about ``middles`` x at heights z,
    that meet in a point at the top."""
    corners = [(half * sx, half * sy) for sx, sy in CORNERS]
    for low, high, z0, z1 in zip(middles, middles[1:], z, z[1:], strict=False):
        for x, y in corners:
            frame.bar((low + x, y, z0), (high + x, y, z1), 0.05)
            frame.bar((low + x, y, z0), (high - x, y, z1), 0.03)
    for x, y in corners:
        frame.bar((middles[-1] + x, y, z[-1]), (middles[-1], 0, z[-1]), 0.04)


KINDS: Mapping[str, Callable[[float, int, int, Size], Structure]] = MappingProxyType(
    {
        "lattice": lattice,
        "lattice_pole": lattice_pole,
        "tubular": tubular,
        "wooden": wooden,
        "h_frame": h_frame,
        "window": window,
    }
)


def sample(members: np.ndarray, density: float, rng: np.random.Generator) -> np.ndarray:
    """Points (N, 3) on the surface of ``members`` (M, 8), ``density`` per m^2 everywhere.

    All sides have points: the helicopter passes in several directions and nothing is occluded
    (thesis 5.1.1).
    """
    start, end = members[:, :3], members[:, 3:6]
    axis = end - start
    length = np.linalg.norm(axis, axis=1)
    surface = length * np.pi * (members[:, 6] + members[:, 7])
    count = rng.poisson(surface * density)
    which = np.repeat(np.arange(len(members)), count)
    along = rng.random(len(which))
    angle = rng.random(len(which)) * (2 * np.pi)
    radius = members[which, 6] * (1 - along) + members[which, 7] * along
    unit = axis / length[:, None]
    # Any vector that is not parallel to the member spans the circle around it.
    helper = np.where(np.abs(unit[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    first = np.cross(unit, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(unit, first)
    circle = np.cos(angle)[:, None] * first[which] + np.sin(angle)[:, None] * second[which]
    return start[which] + along[:, None] * axis[which] + radius[:, None] * circle


def place(points: np.ndarray, x: float, y: float, z: float, azimuth: float) -> np.ndarray:
    """Points (N, 3) in the frame of a tower, moved to (x, y, z) on a line in direction ``azimuth``.

    The azimuth is in radians, counter-clockwise from east.
    """
    cos, sin = np.cos(azimuth), np.sin(azimuth)
    across, along, up = points.T
    # x of the tower points to the right of the line's direction.
    return np.column_stack((x + along * cos + across * sin, y + along * sin - across * cos, z + up))
