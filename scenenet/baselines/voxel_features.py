"""Features of the surroundings of a voxel, for the boosted trees.

A SCENE-Net observes a voxel through one kernel. A strong baseline (thesis 5.2.4.2) gets features
that are known to identify towers: the height of a voxel above the ground, how far the structure
around it continues upwards, the heights around it, the shape of its neighbourhood and the distance
to conductors. All of them follow from the positions and numbers of points. None uses labels or the
position in the crop, because towers are in the middle of crops.

Windows are in metres, so a grid with half the voxel size gives about the same numbers. A window
smaller than a voxel is a single voxel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from scenenet.baselines.neighbourhoods import around, ball, disk, moments, runs, spread, union
from scenenet.dataset.voxels import VoxelSample


@dataclass(frozen=True)
class VoxelFeature:
    """A feature: its name, its unit (``m``, ``m^2`` or ``1``) and its meaning."""

    name: str
    unit: str
    meaning: str


FEATURES = (
    VoxelFeature("height", "m", "height above the ground"),
    VoxelFeature("run_1", "m", "length of the vertical run around it, in the columns within 1 m"),
    VoxelFeature("run_2", "m", "the same within 2 m"),
    VoxelFeature("run_up_2", "m", "length of the part of that run above the voxel"),
    VoxelFeature("top_1", "m", "height above ground of the highest voxel within 1 m (planar)"),
    VoxelFeature("top_2", "m", "the same within 2 m"),
    VoxelFeature("filled_above_2", "m", "occupied heights above it, in the columns within 2 m"),
    VoxelFeature("filled_5_above_2", "m", "the same in the next 5 m"),
    VoxelFeature("filled_5_below_2", "m", "occupied heights in the 5 m below it, within 2 m"),
    VoxelFeature("share_below_2", "1", "occupied share of the heights down to the ground, 2 m"),
    VoxelFeature("reach_3", "1", "share of the columns within 3 m that reach its height"),
    VoxelFeature("reach_6", "1", "the same within 6 m"),
    VoxelFeature("protrusion", "m", "height above the highest column between 3 and 7 m away"),
    VoxelFeature("overtop_12", "m", "height of the highest column within 12 m above the voxel"),
    VoxelFeature("mean_top_6", "m", "mean height above ground of the columns within 6 m"),
    VoxelFeature("tall_6", "1", "share of the columns within 6 m that are taller than 3 m"),
    VoxelFeature("tall_ring", "1", "the same between 6 and 12 m away"),
    VoxelFeature("area_2", "m^2", "number of occupied voxels within 2 m, times a voxel's face"),
    VoxelFeature("area_4", "m^2", "the same within 4 m"),
    VoxelFeature("linearity_4", "1", "(l1 - l2) / l1 of the occupied voxels within 4 m"),
    VoxelFeature("planarity_4", "1", "(l2 - l3) / l1 of the same"),
    VoxelFeature("verticality_4", "1", "|z| of their main axis"),
    VoxelFeature("points_2", "1", "log(1 + points within 2 m / median of the occupied voxels)"),
    VoxelFeature("column_points", "1", "log(1 + points of its column / median of the columns)"),
    VoxelFeature("conductor_distance", "m", "planar distance to the nearest linear voxel, max. 50"),
    VoxelFeature("conductor_6", "m", "length of the linear voxels within 6 m (planar)"),
)
"""The columns of ``voxel_features``."""

GROUND_WINDOW_M = 9.0
"""Objects narrower than this are not ground."""
GROUND_SMOOTHING_M = 1.5
RUN_GAP_M = 1.0
"""Largest gap within a vertical run: lattice towers and sparse scans leave heights empty."""
STRAY_M, STRAY_NEIGHBOURS = 4.0, 3
"""A voxel with at most this many occupied voxels within this radius, itself included, is a stray
return (a bird, noise), which the heights ignore."""
TALL_M = 3.0
TOP_M = 0.7
MIN_LINEARITY, MAX_VERTICALITY, MIN_CONDUCTOR_HEIGHT_M = 0.85, 0.5, 4.0
"""A voxel is linear, and may be part of a conductor, within these limits: long and thin, nearly
level, and above bushes."""
FARTHEST_CONDUCTOR_M = 50.0


def voxel_features(sample: VoxelSample) -> np.ndarray:
    """``FEATURES`` of every occupied voxel, (M, F) float32, all finite, in the sample's order."""
    if len(sample.index) == 0:
        return np.empty((0, len(FEATURES)), np.float32)
    scene = _Scene.of(sample)
    near, far = scene.moments(2.0), scene.moments(STRAY_M)
    scene = scene.without(far[:, 0] <= STRAY_NEIGHBOURS)
    ground = scene.ground()
    height = scene.middle - scene.at(ground)
    values = {"height": height}
    values |= scene.columns(ground)
    values |= scene.surroundings(ground)
    linearity, planarity, verticality = _axes(far)
    face = scene.voxel_size**2
    values |= {
        "area_2": near[:, 0] * face,
        "area_4": far[:, 0] * face,
        "linearity_4": linearity,
        "planarity_4": planarity,
        "verticality_4": verticality,
    }
    values |= scene.points(near[:, 10])
    level = verticality < MAX_VERTICALITY
    values |= scene.conductors(
        (linearity > MIN_LINEARITY) & level & (height > MIN_CONDUCTOR_HEIGHT_M)
    )
    return np.stack([values[f.name] for f in FEATURES], axis=1).astype(np.float32)


class _Scene(NamedTuple):
    """The occupied voxels of a sample, as a list and as grids.

    Attributes:
        zyx: (M, 3) int32 positions of the occupied voxels.
        kept: (M,) bool, False for stray returns.
        points_in: (D, H, W) int32, number of points in each voxel.
        solid: (D, H, W) uint8, 1 in occupied voxels without the stray returns.
        voxel_size: m.
    """

    zyx: np.ndarray
    kept: np.ndarray
    points_in: np.ndarray
    solid: np.ndarray
    voxel_size: float

    @classmethod
    def of(cls, sample: VoxelSample) -> _Scene:
        shape = sample.grid.shape
        zyx = np.stack(np.unravel_index(sample.index, shape), axis=1).astype(np.int32)
        points = np.zeros(shape, np.int32)
        points.reshape(-1)[sample.index] = sample.count
        solid = (points > 0).astype(np.uint8)
        return cls(zyx, np.ones(len(zyx), bool), points, solid, sample.grid.voxel_size)

    def without(self, stray: np.ndarray) -> _Scene:
        """The same without the voxels ``stray`` (M,) bool; unchanged if all are stray."""
        if stray.all():
            return self
        solid = self.solid.copy()
        solid[tuple(self.zyx[stray].T)] = 0
        return self._replace(kept=~stray, solid=solid)

    @property
    def middle(self) -> np.ndarray:
        """(M,) m, height of the voxel centres above the floor of the grid."""
        return (self.zyx[:, 0] + 0.5) * self.voxel_size

    def at(self, raster: np.ndarray) -> np.ndarray:
        """(M,) values of a raster (H, W) at the voxels."""
        return raster[self.zyx[:, 1], self.zyx[:, 2]]

    def tops(self) -> np.ndarray:
        """(H, W) m, upper face of the highest voxel within ``TOP_M`` of each column; NaN if there
        is none.

        With voxels below 0.7 m a conductor also counts for the neighbouring columns, so that it
        covers about as much of the surroundings as with voxels of 1 m.
        """
        highest = self.solid.shape[0] - self.solid[::-1].argmax(axis=0)
        tops = np.where(self.solid.any(axis=0), highest * self.voxel_size, -np.inf)
        steps = disk(TOP_M, self.voxel_size)
        reach = int(np.abs(steps).max())
        window = np.zeros((2 * reach + 1,) * 2, bool)
        window[tuple((steps + reach).T)] = True
        tops = ndimage.maximum_filter(tops, footprint=window, mode="constant", cval=-np.inf)
        return np.where(np.isfinite(tops), tops, np.nan)

    def ground(self) -> np.ndarray:
        """(H, W) m, elevation of the ground above the floor of the grid.

        It is computed from the lowest voxel of each column; empty columns take the nearest one. A
        median removes single low returns, and an opening removes objects narrower than its window,
        also on slopes.
        """
        some = self.solid.any(axis=0)
        nearest = ndimage.distance_transform_edt(~some, return_distances=False, return_indices=True)
        lowest = (self.solid.argmax(axis=0) * self.voxel_size)[tuple(nearest)]
        small, large = (_odd(m, self.voxel_size) for m in (GROUND_SMOOTHING_M, GROUND_WINDOW_M))
        lowest = ndimage.median_filter(lowest, max(3, small), mode="nearest")
        opened = ndimage.grey_opening(lowest, size=(large, large), mode="nearest")
        return ndimage.uniform_filter(opened, max(3, small), mode="nearest")

    def moments(self, radius: float) -> np.ndarray:
        """(M, 11): number, sums, second moments and points of the voxels within ``radius`` m."""
        return moments(self.points_in, self.zyx, ball(radius, self.voxel_size))

    def columns(self, ground: np.ndarray) -> dict[str, np.ndarray]:
        """Features of the columns around a voxel, above and below it."""
        depth, _, width = self.solid.shape
        h, z = self.voxel_size, self.zyx[:, 0]
        column, of = np.unique(self.zyx[:, 1] * width + self.zyx[:, 2], return_inverse=True)
        yx = np.stack(np.divmod(column, width), axis=1).astype(np.int32)
        upright = np.ascontiguousarray(self.solid.transpose(1, 2, 0))
        floor = self.at(ground)
        values = {}
        for radius in (1.0, 2.0):
            filled = union(upright, yx, disk(radius, h))
            highest = np.where(filled.any(axis=1), depth - filled[:, ::-1].argmax(axis=1), 0)
            up, down = runs(filled, int(RUN_GAP_M / h + 1e-9))
            # A stray return belongs to no run.
            values[f"run_{radius:g}"] = np.maximum(up[of, z] + down[of, z] - 1, 0) * h
            values[f"top_{radius:g}"] = highest[of] * h - floor
        below = np.zeros((len(filled), depth + 1), np.int32)
        filled.cumsum(axis=1, dtype=np.int32, out=below[:, 1:])
        foot = np.clip(np.rint(floor / h), 0, z).astype(int)
        five = max(1, round(5 / h))
        here, above = below[of, z], below[of, z + 1]
        return values | {
            "run_up_2": up[of, z] * h,
            "filled_above_2": (below[of, -1] - above) * h,
            "filled_5_above_2": (below[of, np.minimum(z + 1 + five, depth)] - above) * h,
            "filled_5_below_2": (here - below[of, np.maximum(z - five, 0)]) * h,
            "share_below_2": (above - below[of, foot]) / (z + 1 - foot),
        }

    def surroundings(self, ground: np.ndarray) -> dict[str, np.ndarray]:
        """Features of the heights around a voxel."""
        h, z, tops = self.voxel_size, self.middle, self.tops()
        stature, tall = tops - ground, np.full(len(self.zyx), TALL_M)

        def look(raster: np.ndarray, level: np.ndarray, outer: float, inner: float = -1.0):
            return around(raster, self.zyx, level, disk(outer, h, inner)).T

        tall_6, mean_top_6, _ = look(stature, tall, 6.0)
        return {
            "reach_3": look(tops, z, 3.0)[0],
            "reach_6": look(tops, z, 6.0)[0],
            "protrusion": z - look(tops, z, 7.0, 3.0)[2],
            "overtop_12": look(tops, z, 12.0)[2] - z,
            "mean_top_6": mean_top_6,
            "tall_6": tall_6,
            "tall_ring": look(stature, tall, 12.0, 6.0)[0],
        }

    def points(self, near: np.ndarray) -> dict[str, np.ndarray]:
        """Numbers of points relative to the median of the crop, as surveys differ in density."""
        columns = self.points_in.sum(axis=0)
        return {
            "points_2": np.log1p(near / np.median(near)),
            "column_points": np.log1p(self.at(columns) / np.median(columns[columns > 0])),
        }

    def conductors(self, linear: np.ndarray) -> dict[str, np.ndarray]:
        """Distance to and length of the ``linear`` voxels (M,) bool."""
        length = np.zeros(self.solid.shape[1:])
        z, y, x = self.zyx[linear & self.kept].T
        np.add.at(length, (y, x), self.voxel_size)
        distance = np.full(length.shape, FARTHEST_CONDUCTOR_M)
        if len(z):
            exact = ndimage.distance_transform_edt(length == 0) * self.voxel_size
            distance = np.minimum(exact, FARTHEST_CONDUCTOR_M)
        places = np.unique(self.zyx[linear & self.kept][:, 1:], axis=0)
        nearby = spread(length, places, disk(6.0, self.voxel_size))
        return {"conductor_distance": self.at(distance), "conductor_6": self.at(nearby)}


def _odd(metres: float, voxel_size: float) -> int:
    """Odd number of voxels, at least one, in a window ``metres`` wide."""
    return 2 * round(metres / voxel_size / 2) + 1


def _axes(sums: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Linearity, planarity and verticality, each (M,) in [0, 1], from ``moments``; 0 if the voxels
    have no extent."""
    number = np.maximum(sums[:, 0], 1)[:, None]
    mean = sums[:, 1:4] / number
    covariance = np.empty((len(sums), 3, 3))
    for column, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)], start=4):
        variance = sums[:, column] / number[:, 0] - mean[:, i] * mean[:, j]
        covariance[:, i, j] = covariance[:, j, i] = variance
    lengths, axes = np.linalg.eigh(covariance)
    third, second, first = lengths.clip(min=0).T
    some = first > 1e-9
    largest = np.where(some, first, 1)
    linearity = np.where(some, (first - second) / largest, 0)
    planarity = np.where(some, (second - third) / largest, 0)
    return linearity, planarity, np.where(some, np.abs(axes[:, 0, 2]), 0)
