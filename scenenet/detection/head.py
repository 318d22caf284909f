"""The head of a tower: its crossarms, in a plane across the line.

The plane is divided into cells. A cell belongs to a crossarm if points lie in the plane and next to
none before and behind it: conductors pass through the plane, and a crown is as thick as it is wide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.detection.profile import Profile

ARM_M = 0.35
"""m, smallest half thickness of a crossarm along the line."""

AIR_M = 1.2
"""m before and behind the plane that has to be free."""

FREE = 1.5
"""Smallest density of points in the plane, as a multiple of the density before and behind it."""

CELL_M = 0.5
"""m, edge of a cell of the plane."""

BRIDGE = 1
"""Cells without a point that a crossarm may have between two with points."""

BEYOND, BEYOND_M = 1.0, 0.5
"""Largest reach of a crossarm beyond the outermost conductor: share of the conductor's, and m."""

REACH = 0.4
"""Largest reach of a crossarm as a share of the height."""


@dataclass(frozen=True)
class Head:
    """Crossarms.

    Attributes:
        cells: (T, H) bool, which cells of the plane belong to them.
        left: m, where the cells start, to the right of the axis (negative).
        low: m above the ground, where the cells start.
        thick: m, half thickness along the line.
    """

    cells: np.ndarray
    left: float
    low: float
    thick: float

    @property
    def reach(self) -> float:
        """m, largest distance of a cell from the axis."""
        column = np.flatnonzero(self.cells.any(axis=1))
        if len(column) == 0:
            return 0.0
        ends = self.left + CELL_M * np.array([column[0], column[-1] + 1])
        return float(np.abs(ends).max())

    def covers(self, t: np.ndarray, h: np.ndarray) -> np.ndarray:
        """(N,) bool, whether positions in the plane, (N,) m each, are in a cell."""
        i = np.floor((t - self.left) / CELL_M).astype(int)
        k = np.floor((h - self.low) / CELL_M).astype(int)
        wide, high = self.cells.shape
        inside = (i >= 0) & (i < wide) & (k >= 0) & (k < high)
        inside[inside] = self.cells[i[inside], k[inside]]
        return inside


NO_HEAD = Head(np.zeros((0, 0), bool), 0.0, 0.0, ARM_M)
"""A tower without crossarms."""


def find_head(
    s: np.ndarray,
    t: np.ndarray,
    h: np.ndarray,
    profile: Profile,
    apart: float,
    low: float,
    high: float,
    reach: float,
) -> Head:
    """The crossarms of a body.

    Args:
        s, t, h: (N,) m, points in the frame of the tower: along the line, to its right, up.
        profile: the body.
        apart: m, half the distance between the bodies of a portal.
        low, high: m above the ground, of the lowest crossarm and the highest conductor.
        reach: m, of the outermost conductor.
    """
    half = float(profile.half_width(np.array([low]))[0])
    furthest = min(reach * (1 + BEYOND), REACH * profile.height) + BEYOND_M
    wide = 2 * int(np.ceil(furthest / CELL_M))
    tall = int(np.ceil((high - low) / CELL_M)) + 2
    left = -wide / 2 * CELL_M
    thick = _thickness(s, t, h, half, apart, low, furthest)
    inside = _count(t, h, np.abs(s) <= thick, left, low, wide, tall) / thick
    free = thick + 0.1
    beside = (np.abs(s) > free) & (np.abs(s) <= free + AIR_M)
    outside = _count(t, h, beside, left, low, wide, tall) / AIR_M
    arm = (inside > 0) & (inside > FREE * outside)
    # A cell has few points; with its neighbours it shows whether a crown is there.
    arm &= _with_neighbours(inside) > FREE * _with_neighbours(outside)
    middle = left + (np.arange(wide) + 0.5) * CELL_M
    body = np.abs(np.abs(middle) - apart) <= half + CELL_M
    return Head(_connected(arm, body), left, low, thick)


def _count(
    t: np.ndarray, h: np.ndarray, which: np.ndarray, left: float, low: float, wide: int, tall: int
) -> np.ndarray:
    """(wide, tall) number of points in each cell."""
    i = np.floor((t[which] - left) / CELL_M).astype(int)
    k = np.floor((h[which] - low) / CELL_M).astype(int)
    inside = (i >= 0) & (i < wide) & (k >= 0) & (k < tall)
    flat = i[inside] * tall + k[inside]
    return np.bincount(flat, minlength=wide * tall).reshape(wide, tall).astype(float)


def _with_neighbours(count: np.ndarray) -> np.ndarray:
    """Sums over each cell and the eight around it."""
    from scipy.ndimage import convolve

    return np.asarray(convolve(count, np.ones((3, 3)), mode="constant"))


def _thickness(
    s: np.ndarray,
    t: np.ndarray,
    h: np.ndarray,
    half: float,
    apart: float,
    low: float,
    furthest: float,
) -> float:
    """m, half thickness of the crossarms: conductors beside them have fewer points."""
    outer = np.abs(np.abs(t) - apart) > half
    beside = (h >= low) & outer & (np.abs(t) <= furthest)
    step = 0.25
    count = np.bincount((np.abs(s[beside]) / step).astype(int), minlength=100)
    first = int(np.ceil((half + 1) / step))
    conductors = np.median(count[first : first + 12])
    n = 0
    while (n + 1) * step < half and count[n] > 2 * conductors + 1:
        n += 1
    return max(n * step + 0.1, ARM_M)


def _connected(arm: np.ndarray, body: np.ndarray) -> np.ndarray:
    """The cells of ``arm`` (T, H) that are connected with the columns ``body`` (T,)."""
    from scipy.ndimage import binary_dilation, label

    reachable = arm | body[:, None]
    bridged = binary_dilation(reachable, np.ones((3, 3), bool), iterations=BRIDGE)
    piece, _ = label(bridged, np.ones((3, 3)))
    with_body = np.unique(piece[body])
    return np.asarray(arm & np.isin(piece, with_body[with_body > 0]))
