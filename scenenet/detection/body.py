"""Measures the body on an axis: foot, height, continuity and centre.

All positions are centres of occupied voxels on one lattice, (M, 3) m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from scenenet.core.compilation import EXACT
from scenenet.detection.conductor_rules import POLE_M
from scenenet.detection.within import within

SLIM = 1 / 8
"""Largest half width of a body as a share of its height; legs may be twice as wide."""

SLIM_M = 2.0
"""m, smallest search radius for a body, because the axis is only known to a voxel or two."""

TOP_GAP = 3.0
"""m, a gap that ends a tower upwards, so that a bird above it is not its top."""

STRAY_GAP = 10.0
"""m, a gap between detected voxels that ends it too, because a stray return high above can look
like a pole."""

LOWEST = 5
"""Percentile of the elevations at the foot that counts as its ground."""

MIDDLE = 0.3, 0.9
"""Shares of the height between which the body is measured: below are shrubs and its legs."""

SEARCH_RADII = 2.0, 1.5, 1.0
"""Successive search radii for the centre, in multiples of the slim radius. The axis may start on a
leg or a crossarm."""

POLE_RADII = (2.0,)
"""The same for a pole, of which ``POLE_M / 2`` is the slim radius: the axis starts on it, and the
next pole is further away."""

ALONE = 0.5
"""Smallest share of its levels at which a pole stands free of what is beside it."""


@dataclass(frozen=True)
class Body:
    """The body on an axis.

    Attributes:
        base: m, elevation of the ground at its foot.
        height: m, from the base to its top.
        upright: share of the levels from foot to top with an occupied voxel.
    """

    base: float
    height: float
    upright: float


def measure_body(
    around: np.ndarray,
    axis: np.ndarray,
    elevations: np.ndarray,
    foot_radius: float,
    voxel_size: float,
) -> Body:
    """The body on an axis (2,) m.

    Args:
        around: (M, 3) m, occupied voxels.
        elevations: (N,) m, of its detected voxels, at least one.
        foot_radius: m, radius in which the ground is measured.
        voxel_size: m.
    """
    return Body(*_measured(*_columns(around), *axis.tolist(), elevations, foot_radius, voxel_size))


def centre_body(
    around: np.ndarray, axis: np.ndarray, body: Body, voxel_size: float
) -> tuple[np.ndarray, float]:
    """Axis (2,) m through the centre of a body, and the share that stands free.

    At each level the body consists of the connected voxels near the axis. A level stands free if
    they are slim; otherwise a conductor, a tree or a building touches the body. If no level stands
    free, the axis does not change.
    """
    slim = max(SLIM_M, SLIM * body.height)
    return _centre(around, axis, body, voxel_size, slim, SEARCH_RADII)


def centre_pole(
    around: np.ndarray, axis: np.ndarray, body: Body, voxel_size: float
) -> np.ndarray | None:
    """Axis (2,) m through the pole on which an axis starts; None if nothing as slim stands there.

    To ``centre_body``, two poles side by side may be the legs of one body between them.
    """
    axis, free = _centre(around, axis, body, voxel_size, POLE_M / 2, POLE_RADII)
    return axis if free >= ALONE else None


def _centre(
    around: np.ndarray,
    axis: np.ndarray,
    body: Body,
    voxel_size: float,
    slim: float,
    radii: tuple[float, ...],
) -> tuple[np.ndarray, float]:
    """``centre_body`` for a body of a ``slim`` radius in m, looked for within ``radii``, multiples
    of it."""
    place = *axis.tolist(), body.base
    east, north, free = _centred(
        *_columns(around), *place, body.height, voxel_size, slim, np.array(radii)
    )
    return axis + np.array([east, north]), free


def _columns(xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y and z (N,) of positions (N, 3)."""
    x, y, z = (np.ascontiguousarray(column) for column in xyz.T)
    return x, y, z


@numba.njit(**EXACT)
def _measured(
    x, y, z, east, north, elevations, foot_radius, voxel_size
):  # pragma: no cover - compiled
    """Base, height and upright of ``Body``."""
    lowest_seen = elevations.min()
    near = np.empty(len(z) + 1)
    near[0], n = lowest_seen, 1
    for i in range(len(z)):
        near[n] = z[i]
        n += within(x[i] - east, y[i] - north, foot_radius)
    # A percentile, because a single return below the ground would make a bush as tall as a tower.
    lowest = _percentile(near[:n], LOWEST / 100)
    detected = _distinct(_levels(elevations, lowest_seen, voxel_size))
    middle = int((_median(elevations) - lowest_seen) / voxel_size)
    head = _unbroken(detected, middle, STRAY_GAP / voxel_size)
    height = lowest_seen + head * voxel_size - lowest
    slim = max(SLIM_M, SLIM * height)
    n = 0
    for i in range(len(z)):
        leg = z[i] - lowest < MIDDLE[0] * height
        near[n] = z[i]
        n += within(x[i] - east, y[i] - north, 2 * slim if leg else slim)
    # Levels count from the lowest detected voxel, which is on the lattice.
    levels = _distinct(_levels(near[:n], lowest_seen, voxel_size))
    foot = int(np.rint((lowest - lowest_seen) / voxel_size))
    seen = np.empty(len(levels) + len(detected))
    n = 0
    for level in levels:
        seen[n] = level
        n += 1
    for level in detected:
        if level <= head:
            seen[n] = level
            n += 1
    top = _unbroken(_distinct(seen[:n]), middle, TOP_GAP / voxel_size)
    n = 0
    for level in levels:
        n += foot <= level <= top
    upright = n / (top - foot + 1)
    base = lowest - voxel_size / 2
    return base, lowest_seen + (top + 0.5) * voxel_size - base, upright


# One sort of floats serves levels, percentiles and medians, and loops stand for expressions of
# arrays: numba compiles each sort, selection and expression of arrays anew, at seconds apiece.


@numba.njit(**EXACT)
def _levels(elevations, lowest, voxel_size):  # pragma: no cover - compiled
    """Level (N,), a whole number, of elevations (N,) m."""
    levels = np.empty(len(elevations))
    for i in range(len(elevations)):
        levels[i] = np.rint((elevations[i] - lowest) / voxel_size)
    return levels


@numba.njit(**EXACT)
def _distinct(levels):  # pragma: no cover - compiled
    """The different ones of levels (N,), ascending integers."""
    ordered = np.sort(levels)
    distinct = np.empty(len(ordered), np.int64)
    n = 0
    for i in range(len(ordered)):
        if i == 0 or ordered[i] != ordered[i - 1]:
            distinct[n] = np.int64(ordered[i])
            n += 1
    return distinct[:n]


@numba.njit(**EXACT)
def _median(values):  # pragma: no cover - compiled
    """As ``np.median`` gives it, to the bit."""
    ordered = np.sort(values)
    half = len(ordered) // 2
    if len(ordered) % 2:
        return ordered[half]
    return (ordered[half - 1] + ordered[half]) / 2


@numba.njit(**EXACT)
def _unbroken(levels, start, gap):  # pragma: no cover - compiled
    """The highest of ascending levels (N,) above ``start`` before a gap wider than ``gap``."""
    last = start
    for level in levels:
        if level > start:
            if level - last > gap:
                break
            last = level
    return last


@numba.njit(**EXACT)
def _percentile(values, share):  # pragma: no cover - compiled
    """As ``np.percentile`` interpolates it, to the bit."""
    ordered = np.sort(values)
    at = (len(ordered) - 1) * share
    below = int(at)
    if below + 1 >= len(ordered):
        return ordered[-1]
    low, high, part = ordered[below], ordered[below + 1], at - below
    return high - (high - low) * (1 - part) if part >= 0.5 else low + (high - low) * part


@numba.njit(**EXACT)
def _centred(
    x, y, z, east, north, base, height, voxel_size, slim, radii
):  # pragma: no cover - compiled
    """What ``_centre`` gives, the axis relative to (``east``, ``north``)."""
    places = np.empty((len(x), 3))
    n = 0
    for i in range(len(x)):
        px, py, pz = x[i] - east, y[i] - north, z[i] - base
        if MIDDLE[0] * height <= pz <= MIDDLE[1] * height and within(px, py, 4 * slim):
            places[n, 0], places[n, 1], places[n, 2] = px, py, pz
            n += 1
    if n == 0:
        return 0.0, 0.0, 0.0
    places = places[:n]
    level, piece, n_pieces = _pieces(places, voxel_size)
    at_east, at_north, free = 0.0, 0.0, 0.0
    for multiple in radii:
        reached = np.zeros(n_pieces, np.bool_)
        for i in range(n):
            if within(places[i, 0] - at_east, places[i, 1] - at_north, multiple * slim):
                reached[piece[i]] = True
        if not reached.any():
            continue
        n_levels = level.max() + 1
        least, greatest = np.full((n_levels, 2), np.inf), np.full((n_levels, 2), -np.inf)
        for i in range(n):
            if reached[piece[i]]:
                for k in range(2):
                    least[level[i], k] = min(least[level[i], k], places[i, k])
                    greatest[level[i], k] = max(greatest[level[i], k], places[i, k])
        middles = np.empty((2, n_levels))
        n_seen = n_free = 0
        for k in range(n_levels):
            if greatest[k, 0] < least[k, 0]:
                continue
            n_seen += 1
            wide = max(greatest[k, 0] - least[k, 0], greatest[k, 1] - least[k, 1]) + voxel_size
            if wide <= 2 * slim + voxel_size:
                for axis in range(2):
                    middles[axis, n_free] = (least[k, axis] + greatest[k, axis]) / 2
                n_free += 1
        if n_free:
            at_east, at_north = _median(middles[0, :n_free]), _median(middles[1, :n_free])
            free = n_free / n_seen
    return at_east, at_north, free


@numba.njit(**EXACT)
def _pieces(places, voxel_size):  # pragma: no cover - compiled
    """Level (N,) of voxels (N, 3) m, number (N,) of the piece of its level that each is connected
    to, also over a corner, and the number of pieces."""
    n = len(places)
    steps = np.empty((n, 3), np.int64)
    last = np.zeros(3, np.int64)
    for k in range(3):
        least = places[0, k]
        for i in range(n):
            least = min(least, places[i, k])
        for i in range(n):
            steps[i, k] = np.int64(np.rint((places[i, k] - least) / voxel_size))
            last[k] = max(last[k], steps[i, k])
    at = np.full((last[0] + 3, last[1] + 3, last[2] + 1), -1, np.int64)  # with a border
    for i in range(n):
        at[steps[i, 0] + 1, steps[i, 1] + 1, steps[i, 2]] = i
    piece, waiting = np.full(n, -1, np.int64), np.empty(n, np.int64)
    n_pieces = 0
    for i in range(n):
        same = at[steps[i, 0] + 1, steps[i, 1] + 1, steps[i, 2]]
        if same != i or piece[i] >= 0:
            continue
        piece[i], waiting[0], n_waiting = n_pieces, i, 1
        while n_waiting:
            n_waiting -= 1
            a, b, c = steps[waiting[n_waiting]]
            for near in range(9):
                other = at[a + near // 3, b + near % 3, c]
                if other >= 0 and piece[other] < 0:
                    piece[other], waiting[n_waiting] = n_pieces, other
                    n_waiting += 1
        n_pieces += 1
    for i in range(n):
        piece[i] = piece[at[steps[i, 0] + 1, steps[i, 1] + 1, steps[i, 2]]]
    return steps[:, 2], piece, n_pieces
