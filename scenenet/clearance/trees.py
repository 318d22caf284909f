"""Single trees, from the heights of vegetation above the ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.clearance.kinds import PLANT, Surroundings

CELL_M = 0.5
"""m, edge of the cells of the canopy."""

CROWN_M, CROWN = 1.0, 0.06
"""m, and share of its height: how far around its top a tree has no other top."""

LAYER_M, FILLED = 2.0, 0.5
"""m, layers of the upper half of a tree, and the smallest share of them with a point: birds and
returns from the air have nothing below them."""

COLUMN_M = 3
"""m, edge of the columns, of cells of a metre, in which a crown has to stop pulses."""

STOPPED, OVER_M = 0.05, 3
"""Smallest share of the points of a column that end down to so many m below the top
of a crown. Returns from the air are fewer, also where they lie close together above a wood."""

TALLEST_M = 100
"""m, height from which points are counted together: no tree is higher."""

DENSE = 0.1
"""Smallest share of the points in a crown's column that the upper half of the tree has."""


@dataclass(frozen=True)
class Trees:
    """Trees.

    Attributes:
        feet: (n, 3) m, below their tops on the ground.
        height: (n,) m, of their tops above the feet.
    """

    feet: np.ndarray
    height: np.ndarray


def find_trees(around: Surroundings, min_height: float) -> Trees:
    """The trees of ``around`` that are at least so high, m.

    Tops are local maxima of the canopy; a lower one within the crown of a higher one is a part of
    it.
    """
    from scipy import ndimage
    from scipy.spatial import cKDTree

    joined = (around.kind == PLANT) & ~around.lone
    rows = np.flatnonzero(joined & (around.height >= min_height / 2))
    rows = rows[~_in_the_air(around, rows)]
    none = Trees(np.empty((0, 3)), np.empty(0))
    if not len(rows):
        return none
    xy, height = around.xyz[rows, :2], around.height[rows]
    cells = _Cells.of(around.xyz[:, :2])
    canopy = np.zeros(cells.counts.shape)
    np.maximum.at(canopy.reshape(-1), cells.flat[rows], height)
    smooth = ndimage.gaussian_filter(canopy, 1.0, mode="constant")
    peaks = (ndimage.maximum_filter(smooth, size=3, mode="constant") == smooth) & (smooth > 0)
    # The highest point within a metre of a peak is the top.
    # Few places are asked for: to build the tree takes longer than to search it.
    tree = cKDTree(xy, compact_nodes=False, balanced_tree=False)
    near = tree.query_ball_point((np.argwhere(peaks) + cells.corner + 0.5) * CELL_M, CROWN_M)
    tops = np.unique(np.array([own[int(np.argmax(height[own]))] for own in near if own], int))
    tops = tops[height[tops] >= min_height]
    order = tops[np.lexsort((tops, -height[tops]))]
    kept: list[int] = []
    covered = np.zeros(len(xy), bool)
    for row in order.tolist():
        if covered[row]:
            continue
        crown = CROWN_M + CROWN * height[row]
        own = np.array(tree.query_ball_point(xy[row], crown))
        if _is_tree(height[own], float(height[row]), cells.around(xy[row], crown)):
            covered[own] = True
            kept.append(row)
    feet = np.column_stack((xy[kept], around.ground.height(xy[kept])))
    return Trees(feet, height[kept])


def _in_the_air(around: Surroundings, rows: np.ndarray) -> np.ndarray:
    """(r,) bool: which points at rows (r,) are returns from the air, above all crowns.

    A crown stops ``STOPPED`` of the pulses of its column by ``OVER_M`` m below its top.
    """
    from scipy import ndimage

    if not len(rows):
        return np.zeros(0, bool)
    places = [np.floor(around.xyz[:, axis]).astype(int) for axis in range(2)]
    column, row = (place - place.min() for place in places)
    highest = min(int(around.height[rows].max()), TALLEST_M)
    # The layer 0 is the highest one.
    down = highest - np.clip(around.height, 0, highest).astype(int)
    shape = (highest + 1, int(column.max()) + 1, int(row.max()) + 1)
    flat = (down * shape[1] + column) * shape[2] + row
    above = np.bincount(flat, minlength=int(np.prod(shape))).reshape(shape).cumsum(axis=0)
    edge = (1, COLUMN_M, COLUMN_M)
    above = ndimage.convolve(above, np.ones(edge, int), mode="constant")
    reached = np.minimum(down[rows] + OVER_M, highest), column[rows], row[rows]
    return np.asarray(above[reached] < STOPPED * above[-1][reached[1:]])


@dataclass(frozen=True)
class _Cells:
    """Points in square cells.

    Attributes:
        corner: (2,) number of the first cell, x and y.
        counts: (columns, rows) points in each cell.
        flat: (n,) flat number of the cell of each point.
    """

    corner: np.ndarray
    counts: np.ndarray
    flat: np.ndarray

    @classmethod
    def of(cls, xy: np.ndarray) -> _Cells:
        """Of points at (n, 2) m, at least one."""
        # Axis by axis, which is several times as fast as both together.
        column, row = (np.floor(xy[:, axis] / CELL_M).astype(int) for axis in range(2))
        corner = np.array([column.min(), row.min()])
        columns, rows = np.array([column.max(), row.max()]) - corner + 1
        flat = (column - corner[0]) * rows + row - corner[1]
        counts = np.bincount(flat, minlength=columns * rows).reshape(columns, rows)
        return cls(corner, counts, flat)

    def around(self, xy: np.ndarray, radius: float) -> float:
        """Number of points, about, within a radius in m of a place (2,) m."""
        low = np.floor((xy - radius) / CELL_M).astype(int) - self.corner
        high = np.floor((xy + radius) / CELL_M).astype(int) - self.corner + 1
        low = np.maximum(low, 0)
        return float(self.counts[low[0] : high[0], low[1] : high[1]].sum()) * np.pi / 4


def _is_tree(heights: np.ndarray, top: float, points: float) -> bool:
    """Whether points fill the upper half of a tree.

    Args:
        heights: (n,) m, of the points of vegetation in its crown's column.
        top: m, height of its top.
        points: number of all points in this column.
    """
    upper = heights[heights >= top / 2]
    layers = len(np.unique(((top - upper) / LAYER_M).astype(int)))
    filled = layers >= FILLED * (int(top / 2 / LAYER_M) + 1)
    return filled and len(upper) >= DENSE * points
