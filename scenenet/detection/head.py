"""The head of a tower: its crossarms, in a plane across the line, and the members that carry them.

The plane is divided into cells. A cell belongs to a crossarm if points lie in the plane and next to
none before and behind it: conductors pass through the plane, and a crown is as thick as it is wide.
Below the crossarms, such cells are the legs of a window or the braces of a portal where they lead
from the crossarms down to the body.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.detection.conductor_rules import POLE_M
from scenenet.detection.profile import FORK, Profile

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

REACH, WIDE_REACH = 0.4, 0.5
"""Largest reach of a crossarm as a share of the height, and that of a body wider than a pole. So
far, the height of a window tower may be that of its bridge, which is about as long, and often only
the conductors in the window are seen."""

CROSSARM_M, EVEN, SEEN = 1.0, 0.7, 0.8
"""m beyond the body that crossarms on both sides reach at least, the least reach of the shorter one
as a share of that of the longer one, and the least share of their length with points."""

FACE = 0.1
"""Smallest number of points in a step of the thickness of a crossarm, as a share of that in its
fullest step. Both faces of a truss have as many; twigs beside it have few."""

PEAK = 0.4
"""Largest rise of the legs of a window above the conductors that were seen, as a share of the
height so far. Earth wires on their tops are thin and often not seen; the body ends at the beam."""


@dataclass(frozen=True)
class Head:
    """Crossarms, and the members that lead down from them to the body.

    Attributes:
        cells: (T, H) bool, which cells of the plane belong to them.
        left: m, where the cells start, to the right of the axis (negative).
        low: m above the ground at the axis, where the cells start.
        thick: m, half thickness along the line.
    """

    cells: np.ndarray
    left: float
    low: float
    thick: float

    @property
    def extent(self) -> tuple[float, float]:
        """m, from the leftmost to the rightmost cell, to the right of the axis; 0, 0 for none."""
        column = np.flatnonzero(self.cells.any(axis=1))
        if len(column) == 0:
            return 0.0, 0.0
        return self.left + CELL_M * float(column[0]), self.left + CELL_M * float(column[-1] + 1)

    @property
    def reach(self) -> float:
        """m, largest distance of a cell from the axis."""
        return max(map(abs, self.extent))

    def is_even(self, half_width: float) -> bool:
        """Whether crossarms reach about equally far beyond both sides of a body of ``half_width``
        m, without gaps.

        The branches of a tree do not.
        """
        left, right = self.extent
        short, long = sorted((-left - half_width, right - half_width))
        seen = self.cells.any(axis=1).sum() * CELL_M
        return bool(short >= CROSSARM_M and short >= EVEN * long and seen >= SEEN * (right - left))

    def covers(self, t: np.ndarray, h: np.ndarray) -> np.ndarray:
        """(N,) bool, whether positions in the plane are in a cell: ``t`` m to the right of the
        axis, ``h`` m above the ground there, (N,) each."""
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
        s, t, h: (N,) m, points in the frame of the tower: along the line, to its right, and above
            the ground at the axis. Points lower than ``FORK`` of the height may be left out.
        profile: the body.
        apart: m, half the distance between the bodies of a portal.
        low, high: m above the ground at the axis, of the lowest crossarm and the highest conductor.
        reach: m, of the outermost conductor.
    """
    half = float(profile.half_width(np.array([low]))[0])
    furthest = min(reach * (1 + BEYOND), REACH * profile.height) + BEYOND_M
    if 2 * half > POLE_M:
        furthest = WIDE_REACH * profile.height + BEYOND_M
    wide = 2 * int(np.ceil(furthest / CELL_M))
    below = max(int((low - FORK * profile.height) / CELL_M), 0)
    fork = low - below * CELL_M
    known = int(np.ceil((high - low) / CELL_M)) + 2 + below
    tall = known + int(PEAK * profile.height / CELL_M)
    left = -wide / 2 * CELL_M
    thick = _thickness(s, t, h, half, apart, low, furthest)
    inside = _count(t, h, np.abs(s) <= thick, left, fork, wide, tall) / thick
    free = thick + 0.1
    beside = (np.abs(s) > free) & (np.abs(s) <= free + AIR_M)
    outside = _count(t, h, beside, left, fork, wide, tall) / AIR_M
    member = (inside > 0) & (inside > FREE * outside)
    # A cell has few points; with its neighbours it shows whether a crown is there.
    member &= _with_neighbours(inside) > FREE * _with_neighbours(outside)
    middle = left + (np.arange(wide) + 0.5) * CELL_M
    body = np.zeros((wide, tall), bool)
    # Nothing above it is connected with the body through the air: a bird is not a peak.
    body[np.abs(np.abs(middle) - apart) <= half + CELL_M, :known] = True
    arm = _connected(member, body, below)
    return Head(_with_legs(member, arm, np.abs(middle), apart, below), left, fork, thick)


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
    # A truss has two faces with little between them, so the outermost of its steps counts.
    within = count[: max(int(np.ceil(half / step)) - 1, 0)]
    full = np.flatnonzero(within > max(2 * conductors + 1, FACE * within.max(initial=0)))
    return max((full[-1] + 1) * step + 0.1 if len(full) else 0.0, ARM_M)


def _connected(arm: np.ndarray, body: np.ndarray, below: int) -> np.ndarray:
    """The cells of ``arm`` (T, H) that are connected with those of the ``body`` (T, H), without the
    ``below`` lowest rows."""
    from scipy.ndimage import binary_dilation, label

    arm, body = arm[:, below:], body[:, below:]
    reachable = arm | body
    bridged = binary_dilation(reachable, np.ones((3, 3), bool), iterations=BRIDGE)
    piece, _ = label(bridged, np.ones((3, 3)))
    with_body = np.unique(piece[body])
    connected = arm & np.isin(piece, with_body[with_body > 0])
    return np.pad(connected, ((0, 0), (below, 0)))


def _with_legs(
    member: np.ndarray, arm: np.ndarray, away: np.ndarray, apart: float, below: int
) -> np.ndarray:
    """The cells of the crossarms (T, H), and those of members that lead down from them.

    Such members lead towards the body, or are between the bodies of a portal: a crown beside the
    body is further out than what is above it.

    Args:
        member: (T, H) bool, cells in which something thin stands in free air.
        away: (T,) m, of the cells from the axis.
        apart: m, half the distance between the bodies of a portal.
        below: number of rows below the lowest crossarm.
    """
    from scipy.ndimage import binary_dilation

    found = arm.copy()
    for row in range(below - 1, -1, -1):
        over = found[:, row + 1 : row + 2 + BRIDGE].any(axis=1)
        if not over.any():
            break
        near = binary_dilation(over, iterations=BRIDGE + 1)
        outermost = max(float(away[over].max()), apart)
        found[:, row] = member[:, row] & near & (away <= outermost)
    return found
