"""Wires that leave a place: what tells a tower from everything else that is tall.

A conductor is long, thin and nearly level, it hangs in free air and it leads away from the head of
what carries it. All of this can be seen in the occupied voxels, without a label: a treetop stands
on its tree, a roof is as wide as it is long, a street light has nothing to hang on to.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

HEAD = 0.6
"""Part of the height above which conductors are looked for: below are the ground, shrubs and the
body, and of several levels of conductors at least one hangs in the upper two fifths."""

FREE_AIR = 3.0
"""m under a conductor in which there is nothing: about what is kept clear between it and trees."""

FREE_AIR_PART = 1 / 8
"""The same as a part of the height. Conductors one above the other keep such a distance; the
storeys of a building, three to four metres, do not."""

NEAR, FAR = 3.0, 20.0
"""m from the axis between which conductors are looked for: beyond the body, and as far as the crop
of a tower reaches."""

RISE = 0.5
"""Steepest conductor, m a metre: at the head of a tower on a slope it is a third."""

SCALES = 2.0, 4.0, 8.0
"""m, radii of the neighbourhoods that are called long and thin or not. A small one sees a single
conductor; conductors one to three metres apart look like one ribbon to a large one. With three
radii there is one for any distance between them."""

THIN = 0.25
"""Largest variance across a conductor, or a ribbon of them, as a part of the variance along it. The
edge of a half plane, that is of a roof, has 0.28."""

MIN_VOXELS = 5
"""A direction is not measured on fewer voxels."""

SECTOR = 15.0
"""Degrees by which bearings of one span differ: voxels are coarse, and conductors spread out from
the head to the crossarms of the next tower."""

APART = 45.0
"""Degrees between two spans; a line turns less sharply than it doubles back."""

GAP = 2.0
"""m along a conductor in which a scanner may have missed it."""

SHORTEST = 7.0
"""m; rows of treetops are seldom longer."""


@dataclass(frozen=True)
class Span:
    """Wires that leave in one direction.

    Attributes:
        bearing: degrees from north (+y), clockwise.
        length: m along which they are seen without a gap, between ``NEAR`` and ``FAR``.
        followed: that length as a part of the way from ``NEAR`` to ``FAR``, or to where the data
            end in this direction.
    """

    bearing: float
    length: float
    followed: float


def leaving_spans(
    surroundings: np.ndarray,
    axis: tuple[float, float],
    base: float,
    height: float,
    crossarm: float,
    voxel_size: float,
) -> list[Span]:
    """Directions in which wires leave a tower, the longest first.

    Args:
        surroundings: (M, 3) m, middles of the occupied voxels, at least those within
            ``FAR + max(SCALES)`` of the axis in plan. They must lie on one lattice.
        axis: m, x and y of the tower.
        base, height: m, elevation of its foot and height above it.
        crossarm: m, how far beside the axis a conductor may hang.
        voxel_size: m.
    """
    relative = surroundings - np.array([*axis, base])
    distance = np.hypot(relative[:, 0], relative[:, 1])
    near = relative[distance <= FAR + max(SCALES)]
    if len(near) < MIN_VOXELS:
        return []
    distance = np.hypot(near[:, 0], near[:, 1])
    at_head = (near[:, 2] >= HEAD * height) & (near[:, 2] <= height + RISE * distance)
    if at_head.sum() < MIN_VOXELS:
        return []
    free_air = max(FREE_AIR, FREE_AIR_PART * height)
    hanging = near[at_head & _hangs(near, voxel_size, free_air)]
    if len(hanging) < MIN_VOXELS:
        return []
    off_axis = np.hypot(hanging[:, 0], hanging[:, 1])
    # The way along a conductor is at most the distance, and less than it by the offset.
    asked = (off_axis >= NEAR) & (off_axis <= np.hypot(FAR, crossarm))
    place, heading = _thin(hanging, asked)
    # Pointing away from the tower, along s; t is the distance at which it passes the axis.
    s = np.einsum("ni,ni->n", place[:, :2], heading)
    heading = np.where(s[:, None] < 0, -heading, heading)
    s = np.abs(s)
    t = np.abs(place[:, 0] * heading[:, 1] - place[:, 1] * heading[:, 0])
    leaves = (s >= NEAR) & (s <= FAR) & (t <= crossarm)
    towards = _bearing(near)
    spans = []
    for bearing, length in _runs(_bearing(heading[leaves]), s[leaves]):
        end = distance[_turn(towards, bearing) <= SECTOR].max(initial=NEAR)
        way = max(min(float(end), FAR) - NEAR, SHORTEST)
        spans.append(Span(bearing, length, min(1.0, length / way)))
    return spans


def _hangs(places: np.ndarray, voxel_size: float, free_air: float) -> np.ndarray:
    """(M,) whether the next voxel of the same column below is further away than ``free_air``.

    Two voxels on top of one another count as one, because a wire that crosses from one to the
    other fills both.
    """
    steps = np.rint((places - places.min(axis=0)) / voxel_size).astype(np.int64)
    order = np.lexsort((steps[:, 2], steps[:, 1], steps[:, 0]))
    x, y, z = steps[order].T
    below = np.full(len(order), np.iinfo(np.int64).max // 2)
    same = np.flatnonzero((np.diff(x) == 0) & (np.diff(y) == 0)) + 1
    below[same] = z[same] - z[same - 1]
    touching = np.flatnonzero(below == 1)
    reached = below.copy()
    reached[touching] = below[touching - 1]
    hangs = np.empty(len(order), bool)
    hangs[order] = reached * voxel_size > free_air
    return hangs


def _thin(places: np.ndarray, asked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Those of (M, 3) m that are ``asked`` (M,) for and lie on something long, thin and level.

    Returns:
        (N, 3) m and their headings (N, 2), horizontal and of length one.
    """
    from scipy.spatial import cKDTree

    n = len(places)
    one, other = cKDTree(places).query_pairs(max(SCALES), output_type="ndarray").T
    offset = places[other] - places[one]
    square = np.einsum("ni,ni->n", offset, offset)
    thinnest = np.full(n, np.inf)
    heading = np.zeros((n, 2))
    for radius in SCALES:
        pair = square <= radius**2
        i, j, d = one[pair], other[pair], offset[pair]
        count = 1 + np.bincount(i, minlength=n) + np.bincount(j, minlength=n)
        rows = np.flatnonzero(asked & (count >= MIN_VOXELS))
        mean = np.stack([np.bincount(i, x, n) - np.bincount(j, x, n) for x in d.T], axis=1)
        mean = (mean / count[:, None])[rows]
        spread = np.empty((len(rows), 3, 3))
        for a in range(3):
            for b in range(a, 3):
                product = d[:, a] * d[:, b]
                total = np.bincount(i, product, n) + np.bincount(j, product, n)
                spread[:, a, b] = (total / count)[rows] - mean[:, a] * mean[:, b]
                spread[:, b, a] = spread[:, a, b]
        variance, direction = np.linalg.eigh(spread)
        along = direction[:, :, 2]
        # A line of length l has the variance l^2 / 12; it must fill half of the sphere's diameter.
        long = variance[:, 2] * 12 >= radius**2
        level = np.abs(along[:, 2]) <= RISE
        share = variance[:, 1] / np.maximum(variance[:, 2], 1e-9)
        better = long & level & (share <= THIN) & (share < thinnest[rows])
        thinnest[rows[better]] = share[better]
        heading[rows[better]] = along[better, :2]
    thin = np.isfinite(thinnest)
    return places[thin], heading[thin] / np.linalg.norm(heading[thin], axis=1)[:, None]


def _runs(bearing: np.ndarray, s: np.ndarray) -> Iterator[tuple[float, float]]:
    """Bearing in degrees and length in m of each span, the longest first.

    Args:
        bearing: (M,) degrees, of places on conductors.
        s: (M,) m from the axis.
    """
    while len(bearing):
        runs = []
        for middle in np.arange(0.0, 360.0, SECTOR / 3):
            mine = _turn(bearing, middle) <= SECTOR
            runs.append((_longest_run(s[mine]), int(mine.sum()), -middle))
        length, _, negative = max(runs)
        if length < SHORTEST:
            return
        turned = _turn(bearing, -negative)
        radians = np.radians(bearing[turned <= SECTOR])
        mean = np.degrees(np.arctan2(np.sin(radians).mean(), np.cos(radians).mean())) % 360
        yield float(mean), length
        bearing, s = bearing[turned > APART], s[turned > APART]


def _bearing(vectors: np.ndarray) -> np.ndarray:
    """(M,) degrees from +y, clockwise, of (M, 2 or more)."""
    return np.degrees(np.arctan2(vectors[:, 0], vectors[:, 1])) % 360


def _turn(bearing: np.ndarray, middle: float) -> np.ndarray:
    """Degrees between bearings (M,) and one of them, at most 180."""
    return np.abs((bearing - middle + 180) % 360 - 180)


def _longest_run(s: np.ndarray) -> float:
    """m, longest stretch of the positions (M,) m that has no gap over ``GAP``."""
    if len(s) == 0:
        return 0.0
    metres = np.unique(s.astype(int))
    parts = np.split(metres, np.flatnonzero(np.diff(metres) > GAP) + 1)
    return float(max(part[-1] - part[0] + 1 for part in parts))
