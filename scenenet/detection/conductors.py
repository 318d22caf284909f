"""Conductors that leave a tower, which distinguish it from other tall objects.

A conductor is long, thin and nearly level, hangs in free air and leads away from the head of the
tower that carries it. The occupied voxels show all of this without labels: a treetop has its tree
below, a roof is as wide as it is long, and no conductor leaves a street light.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

HEAD = 0.6
"""Share of the height above which conductors are searched. Ground, shrubs and the body are below,
and of several levels of conductors at least one is in the upper two fifths."""

FREE_AIR = 3.0
"""m of empty space below a conductor, about the clearance that is kept from trees."""

FREE_AIR_SHARE = 1 / 8
"""The same as a share of the height. The levels of conductors are this far apart; the storeys of a
building, three to four metres, are not."""

NEAR, FAR = 3.0, 20.0
"""m from the axis between which conductors are searched: outside the body, and as far as the crop
of a tower reaches."""

RISE = 0.5
"""Steepest slope of a conductor; at the head of a tower on a slope it is about a third."""

SCALES = 2.0, 4.0, 8.0
"""m, radii of the neighbourhoods in which shape is measured. A small neighbourhood shows a single
conductor; in a large one, conductors one to three metres apart look like one ribbon. Three radii
cover all distances between conductors."""

THIN = 0.25
"""Largest variance across a conductor, or a ribbon of conductors, as a share of the variance along
it. The edge of a half plane, such as a roof, has 0.28."""

MIN_VOXELS = 5
"""Smallest number of voxels for which a direction is measured."""

SECTOR = 15.0
"""Largest difference in degrees between the bearings within a span: voxels are coarse, and
conductors diverge from the head to the crossarms of the next tower."""

MIN_ANGLE = 45.0
"""Smallest angle in degrees between two spans; a line never turns back on itself."""

ATTACHED = 10.0
"""m from the axis up to which a conductor is straight enough to say where it is attached."""

GAP = 3.0
"""m, largest gap along a conductor that a scanner may have missed."""

LINE_M = 6.0
"""m, radius in which points are tested for a line; a conductor is straight over twice this."""

LINE_THICK_M = 0.3
"""m, radius of a line: a conductor or a bundle with the noise of its points."""

RING_M = 0.5, 0.8
"""m, radii of the free ring around a line; a bundle is narrower and the next conductor further."""

LINE_POINTS = 4
"""Smallest number of points on a line."""

LINE_BESIDE = 0.25
"""Largest number of points in the ring around a line per point on it. A surface has one, a crown
four."""

LINE_SAMPLE = 120
"""Points of a span that are tested, and directions that are tried."""

MIN_LENGTH = 7.0
"""m, shortest span; rows of treetops are seldom longer."""


@dataclass(frozen=True)
class Span:
    """Conductors that leave in one direction.

    Attributes:
        bearing: degrees from north (+y), clockwise.
        length: m, longest stretch between ``NEAR`` and ``FAR`` without a gap.
        followed: that length as a share of the distance from ``NEAR`` to ``FAR``, or to the edge of
            the data in this direction.
        slope: rise of the conductors per metre away from the tower.
        left, right: m, least and greatest distance to the right of the axis at which they pass it,
            as seen along the bearing.
        lowest, highest: m, heights of the lowest and the highest one above the foot, at the tower.
        places: (M, 3) m, centres of the voxels on the conductors.
        thin: share of the points there that are on a thin line; NaN if it was not measured.
    """

    bearing: float
    length: float
    followed: float
    slope: float
    left: float
    right: float
    lowest: float
    highest: float
    places: np.ndarray = field(repr=False, compare=False)
    thin: float = float("nan")


def leaving_spans(
    surroundings: np.ndarray,
    axis: tuple[float, float],
    base: float,
    height: float,
    crossarm: float,
    voxel_size: float,
) -> list[Span]:
    """Directions in which conductors leave a tower, the longest first.

    Args:
        surroundings: (M, 3) m, centres of the occupied voxels, at least those within
            ``FAR + max(SCALES)`` of the axis in plan. They must be on one lattice.
        axis: m, x and y of the tower.
        base, height: m, elevation of its foot and height above it.
        crossarm: m, largest distance at which a conductor passes the axis.
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
    free_air = max(FREE_AIR, FREE_AIR_SHARE * height)
    hanging = near[at_head & _hangs(near, voxel_size, free_air)]
    if len(hanging) < MIN_VOXELS:
        return []
    off_axis = np.hypot(hanging[:, 0], hanging[:, 1])
    # A conductor may pass the axis at up to ``crossarm``, so FAR along it can be further away.
    candidate = (off_axis >= NEAR) & (off_axis <= np.hypot(FAR, crossarm))
    place, heading, slope = _thin(hanging, candidate)
    # s is the distance along the conductor, t the distance at which it passes the axis. The heading
    # points away from the tower.
    s = np.einsum("ni,ni->n", place[:, :2], heading)
    away = np.where(s < 0, -1.0, 1.0)
    heading, slope, s = heading * away[:, None], slope * away, np.abs(s)
    t = np.abs(place[:, 0] * heading[:, 1] - place[:, 1] * heading[:, 0])
    leaves = (s >= NEAR) & (s <= FAR) & (t <= crossarm)
    place, slope, s = place[leaves], slope[leaves], s[leaves]
    towards = _bearing(near)
    spans = []
    for bearing, length, members in _runs(_bearing(heading[leaves]), s):
        end = distance[_angle(towards, bearing) <= SECTOR].max(initial=NEAR)
        available = max(min(float(end), FAR) - NEAR, MIN_LENGTH)
        rise = float(np.median(slope[members]))
        attached = _attachments(place[members], s[members], bearing, rise)
        followed = min(1.0, length / available)
        places = place[members] + np.array([*axis, base])
        spans.append(Span(bearing, length, followed, rise, *attached, places))
    return spans


def _attachments(
    place: np.ndarray, s: np.ndarray, bearing: float, slope: float
) -> tuple[float, float, float, float]:
    """Where the conductors of a span pass the tower: least and greatest distance to the right of
    the axis, and least and greatest height, m.

    Voxels that continue one another towards the tower are a conductor; treetops are not.

    Args:
        place: (M, 3) m, voxels of the span, relative to the foot.
        s: (M,) m, their distances along it.
    """
    right = np.array([np.cos(np.radians(bearing)), -np.sin(np.radians(bearing))])
    near = s <= max(ATTACHED, float(s.min()) + MIN_LENGTH)
    passes = np.column_stack([place[near, :2] @ right, place[near, 2] - slope * s[near]])
    metre = np.floor(s[near]).astype(int)
    same = (np.abs(passes[:, None] - passes[None]) <= 1.0).all(axis=2)
    continues = np.array([len(np.unique(metre[row])) for row in same])
    conductor = passes[2 * continues >= continues.max()]
    (left, lowest), (right, highest) = conductor.min(axis=0), conductor.max(axis=0)
    return float(left), float(right), float(lowest), float(highest)


def thin_share(points: np.ndarray, span: Span, voxel_size: float) -> float:
    """Share of the points of a span that lie on a straight line with next to nothing beside it.

    Voxels cannot distinguish a conductor from a branch or the edge of a roof that is half a metre
    thick; points can.

    Args:
        points: (N, 3) m, at least those in the voxels of the span.
        voxel_size: m, of the voxels of the span.
    """
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(span.places).query(points)
    inside = np.abs(points - span.places[nearest]).max(axis=1) <= voxel_size / 2 + 1e-6
    on_span = points[inside]
    if len(on_span) < MIN_VOXELS:
        return 0.0
    tree = cKDTree(on_span)
    heading = np.array([np.sin(np.radians(span.bearing)), np.cos(np.radians(span.bearing))])
    rows = np.unique(np.linspace(0, len(on_span) - 1, LINE_SAMPLE).astype(int))
    lines = 0
    for row in rows:
        offset = on_span[sorted(tree.query_ball_point(on_span[row], LINE_M))] - on_span[row]
        lines += _on_line(offset, heading)
    return lines / len(rows)


def _on_line(offset: np.ndarray, heading: np.ndarray) -> bool:
    """Whether a thin line with about the ``heading`` (2,) goes through the point that the
    ``offset`` (N, 3) m of its neighbours are relative to."""
    far = offset[np.abs(offset[:, :2] @ heading) > LINE_M / 4]
    level = np.hypot(far[:, 0], far[:, 1])
    forwards = np.abs(far[:, :2] @ heading) > np.cos(np.radians(SECTOR)) * level
    far = far[forwards & (np.abs(far[:, 2]) <= RISE * level)]
    if len(far) == 0:
        return False
    far = far[:: -(-len(far) // LINE_SAMPLE)]
    direction = far / np.linalg.norm(far, axis=1)[:, None]
    square = np.einsum("ni,ni->n", offset, offset)[:, None] - (offset @ direction.T) ** 2
    on = (square <= LINE_THICK_M**2).sum(axis=0)
    inner, outer = RING_M
    beside = ((square > inner**2) & (square <= outer**2)).sum(axis=0)
    best = int(np.argmax(on - beside))
    return bool(on[best] >= LINE_POINTS and beside[best] <= LINE_BESIDE * on[best])


def _hangs(places: np.ndarray, voxel_size: float, free_air: float) -> np.ndarray:
    """(M,) bool, whether the next occupied voxel below is more than ``free_air`` m away.

    Two adjacent voxels of a column count as one, because a conductor that passes from one to the
    other occupies both.
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


def _thin(places: np.ndarray, candidate: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The candidates that are part of something long, thin and level.

    Args:
        places: (M, 3) m.
        candidate: (M,) bool.

    Returns:
        positions (N, 3) m, horizontal unit vectors (N, 2) along the conductors, and their rise
        (N,) per metre in that direction.
    """
    from scipy.spatial import cKDTree

    n = len(places)
    pairs = cKDTree(places).query_pairs(max(SCALES), output_type="ndarray")
    one, other = pairs[candidate[pairs].any(axis=1)].T  # the others are in no sum of a candidate
    offset = places[other] - places[one]
    square = np.einsum("ni,ni->n", offset, offset)
    thinnest = np.full(n, np.inf)
    heading = np.zeros((n, 3))
    for radius in SCALES:
        pair = square <= radius**2
        i, j, d = one[pair], other[pair], offset[pair]
        count = 1 + np.bincount(i, minlength=n) + np.bincount(j, minlength=n)
        rows = np.flatnonzero(candidate & (count >= MIN_VOXELS))
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
        # A line of length l has the variance l^2 / 12; it must cover half the sphere's diameter.
        long = variance[:, 2] * 12 >= radius**2
        level = np.abs(along[:, 2]) <= RISE
        share = variance[:, 1] / np.maximum(variance[:, 2], 1e-9)
        better = long & level & (share <= THIN) & (share < thinnest[rows])
        thinnest[rows[better]] = share[better]
        heading[rows[better]] = along[better]
    thin = np.isfinite(thinnest)
    level_part = np.linalg.norm(heading[thin, :2], axis=1)
    return places[thin], heading[thin, :2] / level_part[:, None], heading[thin, 2] / level_part


def _runs(bearing: np.ndarray, s: np.ndarray) -> Iterator[tuple[float, float, np.ndarray]]:
    """Bearing in degrees, length in m and members (M,) bool of each span, the longest first.

    Args:
        bearing: (M,) degrees, of voxels on conductors.
        s: (M,) m, their distances along the conductors.
    """
    left = np.ones(len(bearing), bool)
    while left.any():
        runs = []
        for middle in np.arange(0.0, 360.0, SECTOR / 3):
            inside = left & (_angle(bearing, middle) <= SECTOR)
            runs.append((_longest_run(s[inside]), int(inside.sum()), -middle))
        length, _, negative = max(runs)
        if length < MIN_LENGTH:
            return
        angle = _angle(bearing, -negative)
        members = left & (angle <= SECTOR)
        radians = np.radians(bearing[members])
        mean = np.degrees(np.arctan2(np.sin(radians).mean(), np.cos(radians).mean())) % 360
        yield float(mean), length, members
        left &= angle > MIN_ANGLE


def _bearing(vectors: np.ndarray) -> np.ndarray:
    """(M,) degrees from +y, clockwise, of vectors (M, 2 or more)."""
    return np.degrees(np.arctan2(vectors[:, 0], vectors[:, 1])) % 360


def _angle(bearing: np.ndarray, middle: float) -> np.ndarray:
    """Degrees in [0, 180] between bearings (M,) and ``middle``."""
    return np.abs((bearing - middle + 180) % 360 - 180)


def _longest_run(s: np.ndarray) -> float:
    """m, longest stretch of the positions (M,) m without a gap over ``GAP``."""
    if len(s) == 0:
        return 0.0
    metres = np.unique(s.astype(int))
    parts = np.split(metres, np.flatnonzero(np.diff(metres) > GAP) + 1)
    return float(max(part[-1] - part[0] + 1 for part in parts))
