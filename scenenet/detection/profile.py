"""The body of a tower from points: where its axis is and how wide it is at each height.

A body is a narrow prism that tapers upwards and stands in free air. Both are looked for directly:
among positions and widths, those at which most levels have points inside and none just outside.
Crossarms, conductors and vegetation only touch a body at some levels, so they do not move it.

All functions take points in the frame of a tower: s along the line, t across it, both in m from an
approximate axis, and h in m above the ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np

from scenenet.core.compilation import EXACT

SLIM = 1 / 8
"""Largest half width of a body as a share of its height."""

SLIM_M = 2.0
"""m, largest half width of a low tower, such as a portal of two poles."""

SCRUB_M = 1.0
"""m above the ground from which a body is measured, above grass and scrub."""

NARROWEST_M = 0.2
"""m, smallest half width: a pole with the noise of its points."""

WIDTHS_M = (0.3, 0.45, 0.7, 1.0, 1.5, 2.0, 2.75, 3.5, 4.5, 6.0, 8.0)
"""Half widths of the prisms with which an axis is searched."""

SHIFT_M = 2.5
"""m, largest distance of the axis from the approximate one."""

FORK = 0.35
"""Share of the height above which legs of a window, or braces of a portal, carry the crossarms. The
conductor in the window needs its clearance, which leaves less than two thirds for it and more than
a third for the body below."""

GAP_M, GAP_SHARE = 0.6, 0.2
"""Width of the free air around a body: m, and as a share of the half width."""

WIDER = 0.85
"""A prism twice as wide has to be free at 1 / 0.85 times as many levels, because a wide prism may
enclose vegetation beside the body."""

TIGHTER = 0.75
"""The same when the body is measured: insulators and jumpers may be enclosed too."""

POINTS_PER_LEVEL = 3.0
"""Levels are high enough to hold this many points of a body on average."""

LEVELS_M = (0.5, 1.0, 2.0)
"""Heights of levels to choose from."""


@dataclass(frozen=True)
class Profile:
    """The body in the frame of a tower.

    Attributes:
        s, t: m, the axis.
        foot, top: m, half widths at the ground and at the top.
        height: m above the ground at which the half width is ``top``.
        free: share of the levels that stand free.
        level: m, height of a level.
        free_below: share of the levels below ``FORK`` of the height that stand free.
    """

    s: float
    t: float
    foot: float
    top: float
    height: float
    free: float
    level: float
    free_below: float = 0.0

    def half_width(self, h: np.ndarray) -> np.ndarray:
        """(N,) m at heights (N,) m above the ground."""
        return self.foot + (self.top - self.foot) * np.clip(h / self.height, 0, 1)

    @property
    def width(self) -> float:
        """m, at half the height."""
        return self.foot + self.top


def slim(height: float) -> float:
    """m, largest half width of the body of a tower of this height."""
    return max(SLIM_M, SLIM * height)


def furthest(height: float) -> float:
    """m, largest distance along or across the line from an approximate axis to a point that may
    matter: no prism that is tried, with the air around it, reaches further."""
    return SHIFT_M + 3 * slim(height) + 1


def fit_profile(
    s: np.ndarray, t: np.ndarray, h: np.ndarray, height: float, shift: float = SHIFT_M
) -> Profile | None:
    """The body near an approximate axis, or None where nothing stands free.

    Args:
        s, t, h: (N,) m.
        height: m, approximate height of the tower.
        shift: m, largest distance of the axis from the approximate one, at most ``SHIFT_M``.
    """
    inside = (h >= SCRUB_M) & (h <= height)
    inside &= np.maximum(np.abs(s), np.abs(t)) <= furthest(height)
    s, t, h = s[inside], t[inside], h[inside]
    best: tuple[float, float, np.ndarray, float] | None = None
    for level in LEVELS_M:
        found = _search(s, t, h, height, level, shift)
        if found is None:
            continue
        share, width, centre, points = found
        if best is None or share > best[0] + 0.1:
            best = share, width, centre, level
        if points >= POINTS_PER_LEVEL:
            break
    if best is None:
        return None
    _, width, centre, level = best
    at = centre.copy()
    for _ in range(3):
        foot, top, free = _taper(s - at[0], t - at[1], h, height, level, max(1.6 * width, 0.8))
        move = _centre(s - at[0], t - at[1], h, height, level, foot, top, free)
        # A wide prism may reach to another body, which must not draw the axis away.
        at = np.clip(at + move, centre - width, centre + width)
        if np.abs(move).max() < 0.02:
            break
    levels = np.arange(len(free)) * level
    share, below = (
        float(counted.mean()) if len(counted) else 0.0
        for counted in (
            free[levels >= SCRUB_M],
            free[(levels >= SCRUB_M) & (levels < FORK * height)],
        )
    )
    return Profile(float(at[0]), float(at[1]), foot, top, height, share, level, below)


def _search(
    s: np.ndarray, t: np.ndarray, h: np.ndarray, height: float, level: float, shift: float
) -> tuple[float, float, np.ndarray, float] | None:
    """The prism of constant width with most free levels.

    Returns:
        share of free levels, half width in m, axis (2,) m, mean number of points in a free level.
    """
    n_levels = max(1, int(np.ceil(height / level)))
    best: tuple[float, float, np.ndarray, float] | None = None
    merit = 0.0
    prisms = [_Prism.of(width, shift) for width in WIDTHS_M if width <= slim(height)]
    summed: dict[float, np.ndarray] = {}
    for width, prism in zip(WIDTHS_M, prisms, strict=False):
        cell, reach, margin = prism.cell, prism.reach, prism.margin
        if cell not in summed:
            n = max(other.n for other in prisms if other.cell == cell)
            summed[cell] = _summed(s, t, h, cell, n, level, n_levels)
        around = summed[cell], (summed[cell].shape[1] - 1) // 2 - prism.n, reach, margin
        count = _free_levels(*around)
        share = float(count.max()) / n_levels
        worth = share * WIDER ** np.log2(width / WIDTHS_M[0])
        if worth > merit + 1e-9:
            at = np.argwhere(count == count.max()) - (count.shape[0] - 1) // 2
            nearest = at[np.argmin(np.hypot(*at.T))]
            # A portal has two poles that stand equally free; one of them is the body.
            same = at[np.abs(at - nearest).max(axis=1) <= max(reach, margin)]
            centre = same.mean(axis=0) * cell
            i, j = nearest + (count.shape[0] - 1) // 2
            points = _points_inside(*around, i, j)
            merit, best = worth, (share, width, centre, points)
    return best


class _Prism(NamedTuple):
    """A prism of constant width and the air around it, in cells.

    Attributes:
        cell: m.
        reach: cells from its axis to its side.
        margin: cells of free air beside it.
        n: cells from the approximate axis to the furthest that matters.
    """

    cell: float
    reach: int
    margin: int
    n: int

    @classmethod
    def of(cls, width: float, shift: float) -> _Prism:
        """The prism with this half width in m, up to ``shift`` m from the approximate axis."""
        cell = 0.1 if width < 1 else 0.2
        reach, margin = round(width / cell), round(max(GAP_M, GAP_SHARE * width) / cell)
        return cls(cell, reach, margin, round(shift / cell) + reach + margin + 1)


def _summed(
    s: np.ndarray, t: np.ndarray, h: np.ndarray, cell: float, n: int, level: float, n_levels: int
) -> np.ndarray:
    """Points per level and cell, summed along both planar axes from the first cell: (L, C, C) with
    C = 2n + 2. The approximate axis is in the middle of the central one of 2n + 1 cells."""
    i = np.floor(s / cell + 0.5).astype(int) + n
    j = np.floor(t / cell + 0.5).astype(int) + n
    return _sums(i, j, np.floor(h / level).astype(int), 2 * n + 1, n_levels)


@numba.njit(**EXACT)
def _sums(i, j, k, size, n_levels):  # pragma: no cover - compiled
    """What ``_summed`` gives, for points in cells i, j (N,) of ``size`` and levels k (N,)."""
    summed = np.zeros((n_levels, size + 1, size + 1), np.int32)
    for p in range(len(i)):
        if 0 <= i[p] < size and 0 <= j[p] < size and 0 <= k[p] < n_levels:
            summed[k[p], i[p] + 1, j[p] + 1] += 1
    for level in summed:
        for a in range(1, size + 1):
            row = 0
            for b in range(1, size + 1):
                row += level[a, b]
                level[a, b] = level[a - 1, b] + row
    return summed


@numba.njit(**EXACT)
def _free_levels(summed, beside, reach, margin):  # pragma: no cover - compiled
    """(A, A) int32 number of the levels at which the prism about each cell has points inside and
    none in the air around it.

    Args:
        summed: of ``_summed``, for a prism that is ``beside`` cells wider to each side.
        reach, margin: of the prism.
    """
    wide, whole = 2 * reach + 1, 2 * (reach + margin) + 1
    side = summed.shape[1] - 2 * beside - whole
    count = np.zeros((side, side), np.int32)
    for level in summed:
        if level[-1, -1] == 0:
            continue
        for a in range(side):
            low, high = beside + a, beside + a + whole
            # Slices from the first cell of each, so that the loop runs in vector registers.
            west, east = level[low, beside:], level[high, beside:]
            far_west, far_east = level[low, beside + whole :], level[high, beside + whole :]
            low, high = low + margin, low + margin + wide
            first, last = beside + margin, beside + margin + wide
            near, beyond = level[low, first:], level[high, first:]
            far_near, far_beyond = level[low, last:], level[high, last:]
            free = count[a]
            for b in range(side):
                within = far_beyond[b] - far_near[b] - beyond[b] + near[b]
                around = far_east[b] - far_west[b] - east[b] + west[b]
                free[b] += (within > 0) & (around == within)
    return count


@numba.njit(**EXACT)
def _points_inside(summed, beside, reach, margin, a, b):  # pragma: no cover - compiled
    """Mean number of points in the free levels of the prism about cell (a, b) of
    ``_free_levels``."""
    wide, whole = 2 * reach + 1, 2 * (reach + margin) + 1
    a, b = beside + a, beside + b
    points = levels = 0
    for level in summed:
        within = _box(level, a + margin, b + margin, wide)
        if within > 0 and _box(level, a, b, whole) == within:
            points, levels = points + within, levels + 1
    return points / levels


@numba.njit(**EXACT)
def _box(level, a, b, w):  # pragma: no cover - compiled
    """Points in the square of ``w`` cells from a cell of the sums (C, C) of a level."""
    return level[a + w, b + w] - level[a, b + w] - level[a + w, b] + level[a, b]


def _taper(
    s: np.ndarray, t: np.ndarray, h: np.ndarray, height: float, level: float, widest: float
) -> tuple[float, float, np.ndarray]:
    """Half widths in m at the ground and at ``height`` of the tight body with most free levels.

    Returns:
        both half widths, and (L,) bool, which levels are free.
    """
    step = 0.05
    distance = np.maximum(np.abs(s), np.abs(t))
    n_levels = max(1, int(np.ceil(height / level)))
    n = int((widest * (1 + GAP_SHARE) + GAP_M) / step) + 2
    k, b = np.floor(h / level).astype(int), np.floor(distance / step).astype(int)
    inside = (k >= 0) & (k < n_levels) & (b < n)
    flat = np.ravel_multi_index((k[inside], b[inside] + 1), (n_levels, n + 1))
    count = np.bincount(flat, minlength=n_levels * (n + 1)).reshape(n_levels, n + 1).cumsum(axis=1)
    widths = np.unique(np.round(np.geomspace(NARROWEST_M, widest, 24) / step)) * step
    foot, top = (side.ravel() for side in np.meshgrid(widths, widths, indexing="ij"))
    foot, top = foot[foot >= top], top[foot >= top]
    share = np.minimum((np.arange(n_levels) + 0.5) * level / height, 1)
    half = foot[:, None] + (top - foot)[:, None] * share
    outer = half + np.maximum(GAP_M, GAP_SHARE * half)
    levels = np.arange(n_levels)
    within = count[levels, np.minimum(np.round(half / step).astype(int), n)]
    free = (within > 0) & (
        count[levels, np.minimum(np.round(outer / step).astype(int), n)] == within
    )
    best = int(np.argmax(free.sum(axis=1) * TIGHTER ** np.log2((foot + top) / widths[0])))
    return float(foot[best]), float(top[best]), free[best]


def _centre(
    s: np.ndarray,
    t: np.ndarray,
    h: np.ndarray,
    height: float,
    level: float,
    foot: float,
    top: float,
    free: np.ndarray,
) -> np.ndarray:
    """(2,) m, middle of the body at its free levels, from the present axis.

    A pole has points all around it, so the median is its axis. A lattice is hollow and has more
    points where members meet; the middle between its sides is its axis.
    """
    half = foot + (top - foot) * np.clip(h / height, 0, 1)
    k = np.floor(h / level).astype(int)
    inside = (np.maximum(np.abs(s), np.abs(t)) <= half + 0.05) & (k >= 0) & (k < len(free))
    inside[inside] = free[k[inside]]
    if inside.sum() < 3:
        return np.zeros(2)
    s, t, k = s[inside], t[inside], k[inside]
    if foot + top < 1.2:
        return np.array([np.median(s), np.median(t)])
    levels, of_level, count = np.unique(k, return_inverse=True, return_counts=True)
    middle = []
    for values in (s, t):
        low, high = np.full(len(levels), np.inf), np.full(len(levels), -np.inf)
        np.minimum.at(low, of_level, values)
        np.maximum.at(high, of_level, values)
        middles = ((low + high) / 2)[count >= 4]
        middle.append(float(np.median(middles)) if len(middles) else 0.0)
    return np.array(middle)
