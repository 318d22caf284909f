"""Where labelled or true towers stand: position, ground under the axis, and height above it.

The lowest labelled point is not a foot: annotators label scrub and ground around a tower, and scrub
hides the lowest metre of it. The ground under the axis comes from the ground points around it.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from scenenet.pointcloud.cloud import PointCloud

GROUND_RADIUS_M = 3.0
"""Ground points within this planar distance of an axis give the ground under it: on synthetic
corridors the median error of the elevation is 0.05 m, with 8 m it is twice that."""

LEVEL_M2 = 0.01
"""Weight of level ground against the slope of the points, m^2 per point: a plane through points on
one side of the axis would be extrapolated to it."""


class TowerPlaces:
    """Positions and heights of towers, from chunks of points."""

    def __init__(self, towers: pd.DataFrame) -> None:
        """No ground is known yet.

        Args:
            towers: with the columns x, y and top of ``labelled_towers.COLUMNS``.
        """
        self._xy = towers[["x", "y"]].to_numpy(float)
        self._top = towers["top"].to_numpy(float)
        # Sums over the ground points of each tower: of u u^T and of u z, with u = (1, x, y), all
        # relative to the axis and to the top of the tower.
        self._squares = np.zeros((len(towers), 3, 3))
        self._products = np.zeros((len(towers), 3))

    def add(self, cloud: PointCloud) -> None:
        """Take the ground points of a chunk into account."""
        ground = cloud.xyz[cloud.is_ground]
        if len(ground) == 0:
            return
        low, high = ground[:, :2].min(axis=0), ground[:, :2].max(axis=0)
        near = ((self._xy > low - GROUND_RADIUS_M) & (self._xy < high + GROUND_RADIUS_M)).all(
            axis=1
        )
        for number in np.flatnonzero(near):
            local = ground - [*self._xy[number], self._top[number]]
            local = local[(np.abs(local[:, :2]) <= GROUND_RADIUS_M).all(axis=1)]
            local = local[np.hypot(local[:, 0], local[:, 1]) <= GROUND_RADIUS_M]
            terms = np.column_stack([np.ones(len(local)), local[:, :2]])
            self._squares[number] += terms.T @ terms
            self._products[number] += terms.T @ local[:, 2]

    def places(self) -> np.ndarray:
        """(T, 4) m: x, y, elevation of the ground under the axis, and height of the top above it.

        The last two are NaN for a tower without a ground point within ``GROUND_RADIUS_M``.
        """
        height = np.full(len(self._xy), np.nan)
        for number, (squares, products) in enumerate(
            zip(self._squares, self._products, strict=True)
        ):
            n = squares[0, 0]
            if n == 0:
                continue
            mean = products[0] / n
            level = squares + np.diag([0, LEVEL_M2 * n, LEVEL_M2 * n])
            about_mean = products - squares[0] * mean
            height[number] = -(mean + np.linalg.solve(level, about_mean)[0])
        return np.column_stack([self._xy, self._top - height, height])
