"""The ground at the foot of a tower, from points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RADIUS_M = 6.0
"""m around the axis in which the ground is fitted; wider, the curvature of a hill counts."""

CELL_M = 0.75
"""m, cells of which only the lowest point counts: returns from the ground are at least this dense
under open crowns at a few pulses per square metre."""

QUANTILE = 0.25
"""Share of the lowest points below the fitted plane. Most cells see the ground or grass; the rest
end in crowns, and a few returns lie below the ground."""

NEAR_M = 2.5
"""m around the axis in which the plane is moved up or down to the ground that is there."""

STEEPEST = 1.2
"""Largest slope of the ground at a tower."""

SPREAD_M = 1.5
"""m from the plane; lowest points further away are not on the ground."""

SEEN_M, SEEN = 0.5, 0.5
"""m, and the smallest share of the cells whose lowest point is this close to the plane. With fewer,
the ground is not in the data, as in a tower that was cut out; its lowest points are the foot."""

LEGS = 4
"""Cells with the feet of a tower, which are its lowest ones."""

FEET_M, AROUND_M = 12.0, 5.0
"""m around the axis in which the legs of a tower stand, and m above its lowest points near the axis
below which nothing is further away where a tower was cut out: conductors are higher."""

BELOW_M, BELOW = 4.0, 0.1
"""m below the plane, and the largest share of the points so far below it. With more, the plane lies
on conductors or crowns, and the ground is not in the data."""


@dataclass(frozen=True)
class Ground:
    """The ground around an axis, as a plane.

    Attributes:
        elevation: m, at the axis.
        slope: (2,) rise in m per m eastwards and northwards.
    """

    elevation: float
    slope: np.ndarray

    def height(self, east: np.ndarray, north: np.ndarray, z: np.ndarray) -> np.ndarray:
        """(N,) m above the ground: planar offsets from the axis and elevation, (N,) m each."""
        return z - self.elevation - (east * self.slope[0] + north * self.slope[1])

    @property
    def level(self) -> Ground:
        """A level plane at the elevation of the axis, above which a tower is measured."""
        return Ground(self.elevation, np.zeros(2))


def fit_ground(points: np.ndarray, axis: np.ndarray) -> Ground:
    """The ground around an axis.

    A plane through the lower points, by quantile regression, so that neither crowns nor single
    returns from below move it.

    Args:
        points: (N, 3) m, at least one.
        axis: (2,) m.
    """
    near = _within(points, axis)
    low = _lowest(near)
    distance = np.hypot(low[:, 0], low[:, 1])
    design = np.column_stack([low[:, :2], np.ones(len(low))])
    middle = float(np.percentile(low[:, 2], 100 * QUANTILE))
    z = low[:, 2] - middle
    nearness = np.exp(-0.5 * (distance / (2 * RADIUS_M / 3)) ** 2)
    # Without points around the axis the slope stays level.
    level = np.diag([1e-3, 1e-3, 1e-9])
    plane = np.zeros(3)
    for _ in range(30):
        residual = z - design @ plane
        weight = np.where(residual > 0, QUANTILE, 1 - QUANTILE) / np.maximum(np.abs(residual), 0.1)
        weighted = design * (weight * nearness)[:, None]
        change = np.linalg.solve(weighted.T @ design + level, weighted.T @ z) - plane
        plane = plane + change
        if np.abs(change).max() < 1e-3:
            break
    steep = float(np.hypot(plane[0], plane[1]))
    if steep > STEEPEST:
        plane[:2] *= STEEPEST / steep
    residual = z - design @ plane
    there = residual[(distance <= NEAR_M) & (np.abs(residual) < SPREAD_M)]
    if len(there) >= 4:
        plane[2] += np.percentile(there, 35)
    above = near[:, 2] - middle - near[:, :2] @ plane[:2] - plane[2]
    seen = (np.abs(z - design @ plane) < SEEN_M).mean()
    if seen < SEEN or (above < -BELOW_M).mean() > BELOW:
        plane[2] += np.percentile(above, 1)
        foot = Ground(middle + float(plane[2]), plane[:2])
        plane[2] -= _further_down(points, axis, foot)
    return Ground(middle + float(plane[2]), plane[:2])


def _further_down(points: np.ndarray, axis: np.ndarray, foot: Ground) -> float:
    """m that the legs of a tower that was cut out reach below ``foot``, the plane through its
    lowest points near the axis; 0 where the tower was not cut out.

    Args:
        points: (N, 3) m.
        axis: (2,) m.
    """
    offset = points - [*axis, 0.0]
    outside = np.hypot(offset[:, 0], offset[:, 1]) > FEET_M
    if outside.all() or (foot.height(*offset[outside].T) < AROUND_M).any():
        return 0.0
    heights = np.sort(foot.height(*_lowest(offset[~outside]).T))
    # A leg is in several cells; a single return from below is in one.
    return max(-float(heights[min(LEGS, len(heights)) - 1]), 0.0)


def _within(points: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Planar offset from the axis (2,) m and elevation of the points (N, 3) m within ``RADIUS_M``,
    or of all if none is, (M, 3)."""
    east, north = points[:, 0] - axis[0], points[:, 1] - axis[1]
    near = np.flatnonzero((np.abs(east) <= RADIUS_M) & (np.abs(north) <= RADIUS_M))
    near = near[np.hypot(east[near], north[near]) <= RADIUS_M]
    return (points.T[:, near].T if len(near) else points) - [*axis, 0.0]


def _lowest(offset: np.ndarray) -> np.ndarray:
    """The lowest point of each cell, (M, 3)."""
    cells = np.floor(offset[:, :2] / CELL_M).astype(np.int64)
    order = np.lexsort((offset[:, 2], cells[:, 1], cells[:, 0]))
    cells = cells[order]
    first = np.append(True, (np.diff(cells, axis=0) != 0).any(axis=1))
    return np.asarray(offset[order[first]])
