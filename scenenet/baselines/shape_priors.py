"""Towers cut out of points without training: shape priors, from coarse to fine.

"Shape Prior-Guided Coarse-to-Fine Extraction of Overhead Transmission Line Towers from UAV LiDAR
Point Clouds" (Remote Sens. 2026, 18(13), 2082, doi 10.3390/rs18132082) reports an F1 of points of
97.07 % on six corridors with a method of this kind. Only its title, its highlights and the first
lines of its abstract were at hand, so this is **not** its method: it is the chain of steps that
such methods in the literature share, with dimensions of towers (thesis 5.1.2) in place of trained
numbers:

1. height above the ground, from a morphological filter of the lowest points (Zhang et al. 2003,
   doi 10.1109/TGRS.2003.810682);
2. coarse: columns of a grid that are occupied without a gap from the ground to the height of a
   tower, and slender: most levels of their middle have nothing around them;
3. clusters of such columns, and a test of their shape: the slices have one vertical axis;
4. fine: horizontal slices. The body is what lies within a straight taper around the axis; in the
   head, crossarms lie in a plane across the conductors, without which there is no tower.

It knows nothing of labels, and no number in it was chosen on a recording.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.stats import theilslopes

CELL_M = 1.0
"""m, edge of the cells of the grid and height of its levels."""
GROUND_WINDOW_M = 15
"""m, objects narrower than this are not ground (crowns, bodies of towers)."""
MIN_HEIGHT_M = 9.0
"""m, of the lowest wooden poles (thesis 5.1.2 has towers from 18 m)."""
MAX_GAP_M = 2
"""m without a point that a column may have."""
HALF_WIDTH = 0.12
"""Largest half width of a body, as a share of its height: a tower of 17 m is 4.15 m wide (thesis
5.1.2)."""
RING_M = 2.0
"""m beyond that width in which a slender column has nothing around it."""
MIDDLE = (1 / 3, 2 / 3)
"""Shares of the height between which a column has to be slender: scrub is below, the head above."""
MIN_SLENDER = 0.5
"""Smallest share of the levels of the middle at which it is."""
MAX_LEAN = 0.05
"""Largest standard deviation of the centres of the slices, as a share of the height."""
SLICE_M = 0.5
"""m, height of the slices of the fine cut."""
FOOT_M = 0.5
"""m above the ground; grass and scrub are below."""
HEAD = 0.6
"""Share of the height from which there may be crossarms."""
ARM = 0.25
"""Reach of the crossarms from the axis, as a share of the height."""
ARM_HALF_M = 0.6
"""m, half the thickness of the plane of the crossarms along the line."""
EDGE_M = 0.3
"""m without a point beside the axis at which a body ends in a slice."""
MIN_LINEAR = 2.0
"""Smallest ratio of the variances along and across the line of the points beside the head:
conductors leave it in a line, twigs on all sides."""
MARGIN_M = 0.2
"""m around the body: noise of ranging."""


@dataclass(frozen=True)
class CutTowers:
    """Towers that were cut out.

    Attributes:
        points: (N,) bool, which points belong to a tower.
        places: (T, 4) m: x, y, elevation of the ground, and height of each tower.
    """

    points: np.ndarray
    places: np.ndarray


def height_above_ground(xyz: np.ndarray) -> np.ndarray:
    """Height (N,) m of points (N, 3) above the ground, by a morphological filter of the lowest
    points in cells of ``CELL_M``."""
    if len(xyz) == 0:
        return np.empty(0)
    low = xyz[:, :2].min(axis=0)
    position = (xyz[:, :2] - low) / CELL_M
    nx, ny = np.floor(position).astype(int).max(axis=0) + 1
    x, y = np.floor(position).astype(int).T
    lowest = np.full((ny, nx), np.inf)
    np.minimum.at(lowest, (y, x), xyz[:, 2])
    empty = ~np.isfinite(lowest)
    nearest = ndimage.distance_transform_edt(empty, return_distances=False, return_indices=True)
    lowest = ndimage.median_filter(lowest[tuple(nearest)], 3, mode="nearest")
    window = round(GROUND_WINDOW_M / CELL_M)
    # Continued beyond the borders: a slope that ends there would be opened away.
    beyond = [(min(window, side - 1),) * 2 for side in lowest.shape]
    continued = np.pad(lowest, beyond, mode="reflect", reflect_type="odd")
    ground = ndimage.grey_opening(continued, size=(window, window), mode="nearest")
    ground = ground[
        tuple(slice(n, n + side) for (n, _), side in zip(beyond, lowest.shape, strict=True))
    ]
    middle = (position - 0.5).T[::-1]
    return xyz[:, 2] - ndimage.map_coordinates(ground, middle, order=1, mode="nearest")


def cut_out(xyz: np.ndarray) -> CutTowers:
    """The towers among points (N, 3) m."""
    height = height_above_ground(xyz)
    points, places = np.zeros(len(xyz), bool), []
    for axis, top in _coarse(xyz, height):
        own = _fine(xyz, height, axis, top)
        if own is None or len(own) == 0:
            continue
        points[own] = True
        under = np.median((xyz[:, 2] - height)[own])
        places.append([*axis, under, top])
    return CutTowers(points, np.array(places, float).reshape(-1, 4))


def _coarse(xyz: np.ndarray, height: np.ndarray) -> list[tuple[np.ndarray, float]]:
    """Axis (2,) m and height in m of each cluster of slender columns, the tallest first."""
    above = height > 0
    if not above.any():
        return []
    low = xyz[:, :2].min(axis=0)
    z = np.floor(height[above] / CELL_M).astype(int)
    x, y = np.floor((xyz[above, :2] - low) / CELL_M).astype(int).T
    z = np.minimum(z, int(np.percentile(z, 99.99)) + 1)  # a bird needs no levels up to it
    occupied = np.zeros((z.max() + 1, y.max() + 1, x.max() + 1), bool)
    occupied[z, y, x] = True
    top = _continuous_height(ndimage.maximum_filter(occupied, size=(1, 3, 3)))
    candidate = (top * CELL_M >= MIN_HEIGHT_M) & occupied.any(axis=0)
    for row, column in np.argwhere(candidate):
        candidate[row, column] = _slender(occupied, row, column, int(top[row, column]))
    groups, n = ndimage.label(candidate, structure=np.ones((3, 3)))
    found = []
    for group in range(1, n + 1):
        cells = np.argwhere(groups == group)
        tall = float(top[tuple(cells.T)].max()) * CELL_M
        centre = low + (cells[:, ::-1].mean(axis=0) + 0.5) * CELL_M
        if (axis := _axis(xyz, height, centre, tall)) is not None:
            found.append((axis, tall))
    found.sort(key=lambda each: -each[1])
    kept: list[tuple[np.ndarray, float]] = []
    for axis, tall in found:
        if all(np.hypot(*(axis - other)) > HALF_WIDTH * h + RING_M for other, h in kept):
            kept.append((axis, tall))
    return kept


def _continuous_height(occupied: np.ndarray) -> np.ndarray:
    """(H, W) levels up to which each column of a volume (D, H, W) bool has no larger gap than
    ``MAX_GAP_M``, from the ground on."""
    top = np.zeros(occupied.shape[1:], int)
    for level in range(len(occupied)):
        reached = occupied[level] & (level - top <= MAX_GAP_M / CELL_M)
        top[reached] = level + 1
    return top


def _slender(occupied: np.ndarray, row: int, column: int, top: int) -> bool:
    """Whether most levels of the middle of a column have nothing in the ring around it."""
    inner = HALF_WIDTH * top
    outer = inner + RING_M / CELL_M
    reach = int(np.ceil(outer))
    rows = slice(max(0, row - reach), row + reach + 1)
    columns = slice(max(0, column - reach), column + reach + 1)
    first, last = (int(share * top) for share in MIDDLE)
    part = occupied[first:last, rows, columns]
    y, x = np.mgrid[rows, columns][:, : part.shape[1], : part.shape[2]]
    apart = np.hypot(y - row, x - column)
    ring = (apart > max(inner, 1.5)) & (apart <= max(outer, 3.5))
    touched = np.count_nonzero(part[:, ring].any(axis=1))
    return bool(len(part) and 1 - touched / len(part) >= MIN_SLENDER)


def _axis(xyz: np.ndarray, height: np.ndarray, centre: np.ndarray, top: float) -> np.ndarray | None:
    """(2,) m, the axis of the slices around a centre; None if they have none in common."""
    apart = np.hypot(*(xyz[:, :2] - centre).T)
    body = apart <= max(1.5, HALF_WIDTH * top)
    body &= (height > MIDDLE[0] * top / 2) & (height < MIDDLE[1] * top)
    slices = np.floor(height[body] / SLICE_M).astype(int)
    numbers = np.unique(slices)
    if len(numbers) * SLICE_M < top / 6:
        return None
    xy = xyz[body, :2]
    middles = np.array([np.median(xy[slices == number], axis=0) for number in numbers])
    if middles.std(axis=0).max() > MAX_LEAN * top:
        return None
    return np.median(middles, axis=0)


def _fine(xyz: np.ndarray, height: np.ndarray, axis: np.ndarray, top: float) -> np.ndarray | None:
    """Positions of the points of a tower, slice by slice; None if no conductors leave its head."""
    offset = xyz[:, :2] - axis
    near = np.hypot(*offset.T) <= 2 * ARM * top
    near &= (height > FOOT_M) & (height <= top + MARGIN_M)
    rows = np.flatnonzero(near)
    offset, up = offset[rows], height[rows]
    apart = np.hypot(*offset.T)
    half = _taper(apart, up, top)(up)
    head = up >= HEAD * top
    conductors = offset[head & (apart > max(1.5, HALF_WIDTH * top))]
    if len(conductors) < 2:
        return None
    (across, along), vectors = np.linalg.eigh(conductors.T @ conductors)
    if along < MIN_LINEAR * across:
        return None
    arms = head & (apart <= ARM * top)
    arms &= np.abs(offset @ vectors[:, 1]) <= np.maximum(ARM_HALF_M, half)
    return rows[(apart <= half + MARGIN_M) | arms]


def _taper(apart: np.ndarray, up: np.ndarray, top: float) -> np.poly1d:
    """Half width of the body in m over the height in m: a straight line through its slices.

    In each slice the body ends where no point follows within ``EDGE_M``.
    """
    body = (apart <= max(1.0, HALF_WIDTH * top)) & (up < HEAD * top)
    slices = np.floor(up[body] / SLICE_M).astype(int)
    inside = apart[body]
    numbers = np.unique(slices)
    wide = []
    for number in numbers:
        outwards = np.sort(inside[slices == number])
        gaps = np.flatnonzero(np.diff(outwards) > EDGE_M)
        wide.append(outwards[gaps[0] if len(gaps) else -1])
    if len(numbers) < 3:
        return np.poly1d([max(wide, default=EDGE_M)])
    slope, foot, *_ = theilslopes(wide, (numbers + 0.5) * SLICE_M)
    if slope > 0:  # a body widens downwards only; plants at its foot may tilt the line
        return np.poly1d([float(np.median(wide))])
    return np.poly1d([max(slope, -foot / top), foot])
