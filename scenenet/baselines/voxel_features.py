"""Features of a voxel's surroundings for the boosted trees.

A SCENE-Net sees a voxel through one kernel. A model that is to be a fair measure for it (thesis
5.2.4.2) gets what is known to help with towers, worked out beforehand: how high above the ground a
voxel lies, how far what it belongs to goes on upwards, what else stands around, how its
neighbourhood is shaped and whether wires are near. Everything comes from where points are and how
many; labels are never looked at, and neither is the place in the crop, because crops are cut about
towers.

Windows are in metres, so a grid of half the voxel size gives about the same numbers. A window
smaller than a voxel is that voxel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
from scipy import ndimage

from scenenet.dataset.voxels import VoxelSample


@dataclass(frozen=True)
class VoxelFeature:
    """One number of a voxel: its name, its unit (``m``, ``m^2`` or ``1``) and what it says."""

    name: str
    unit: str
    meaning: str


FEATURES = (
    VoxelFeature("height", "m", "above the ground below"),
    VoxelFeature("run_1", "m", "length of the unbroken vertical run it is in, 1 m about it"),
    VoxelFeature("run_2", "m", "the same, 2 m about it"),
    VoxelFeature("run_up_2", "m", "how much of that run lies above"),
    VoxelFeature("top_1", "m", "height above ground of the highest voxel within 1 m (planar)"),
    VoxelFeature("top_2", "m", "the same within 2 m"),
    VoxelFeature("filled_above_2", "m", "occupied heights above, 2 m about it"),
    VoxelFeature("filled_5_above_2", "m", "of these, within the next 5 m"),
    VoxelFeature("filled_5_below_2", "m", "occupied heights in the 5 m below, 2 m about it"),
    VoxelFeature("share_below_2", "1", "share of the heights down to the ground, 2 m about it"),
    VoxelFeature("reach_3", "1", "share of the columns within 3 m that reach this height"),
    VoxelFeature("reach_6", "1", "the same within 6 m"),
    VoxelFeature("protrusion", "m", "above the highest column between 3 and 7 m away"),
    VoxelFeature("overtop_12", "m", "how far the highest column within 12 m lies above"),
    VoxelFeature("mean_top_6", "m", "mean height above ground of the columns within 6 m"),
    VoxelFeature("tall_6", "1", "share of the columns within 6 m that are taller than 3 m"),
    VoxelFeature("tall_ring", "1", "the same between 6 and 12 m away"),
    VoxelFeature("area_2", "m^2", "occupied voxels within 2 m, each a voxel's face in size"),
    VoxelFeature("area_4", "m^2", "the same within 4 m"),
    VoxelFeature("linearity_4", "1", "(l1 - l2) / l1 of the occupied voxels within 4 m"),
    VoxelFeature("planarity_4", "1", "(l2 - l3) / l1 of the same"),
    VoxelFeature("verticality_4", "1", "|z| of their main axis"),
    VoxelFeature("points_2", "1", "log(1 + points within 2 m / median of the occupied voxels)"),
    VoxelFeature("column_points", "1", "log(1 + points of its column / median of the columns)"),
    VoxelFeature("wire_distance", "m", "planar distance to the nearest wire-like voxel, up to 50"),
    VoxelFeature("wire_6", "m", "length of wire-like voxels within 6 m (planar)"),
)
"""The columns of ``voxel_features``."""

GROUND_WINDOW_M = 9.0
"""What is narrower and stands above its surroundings is not ground."""
GROUND_SMOOTHING_M = 1.5
RUN_GAP_M = 1.0
"""A run goes on over gaps up to this: lattice and thin scans leave heights empty."""
STRAY_M, STRAY_NEIGHBOURS = 4.0, 3
"""With fewer others this near a voxel is a stray return (birds, sky), which tops are free of."""
TALL_M = 3.0
TOP_M = 0.7
WIRE_LINEARITY, WIRE_VERTICALITY, WIRE_HEIGHT_M = 0.85, 0.5, 4.0
"""Linear, lying, and above bushes: wire-like."""
FARTHEST_WIRE_M = 50.0


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
    values |= scene.wires(
        (linearity > WIRE_LINEARITY) & (verticality < WIRE_VERTICALITY) & (height > WIRE_HEIGHT_M)
    )
    return np.stack([values[f.name] for f in FEATURES], axis=1).astype(np.float32)


class _Scene(NamedTuple):
    """A sample spread out: occupied voxels (M,) and the grid they lie on.

    ``points_in`` (D, H, W) int32 holds how many points are where, and ``solid`` (D, H, W) uint8 is
    where anything but a stray return is.
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
        """The same without the voxels ``stray`` (M,), all of them kept if all are."""
        if stray.all():
            return self
        solid = self.solid.copy()
        solid[tuple(self.zyx[stray].T)] = 0
        return self._replace(kept=~stray, solid=solid)

    @property
    def middle(self) -> np.ndarray:
        """(M,) m, height of the voxels above the grid's floor."""
        return (self.zyx[:, 0] + 0.5) * self.voxel_size

    def at(self, raster: np.ndarray) -> np.ndarray:
        """(M,) of a raster (H, W)."""
        return raster[self.zyx[:, 1], self.zyx[:, 2]]

    def tops(self) -> np.ndarray:
        """(H, W) m, upper face of the highest voxel within ``TOP_M`` of each column.

        In voxels below 0.7 m a wire counts for the columns beside it as well, so that it takes up
        about as much of the surroundings as in voxels of 1 m. NaN where all these are empty.
        """
        highest = self.solid.shape[0] - self.solid[::-1].argmax(axis=0)
        tops = np.where(self.solid.any(axis=0), highest * self.voxel_size, -np.inf)
        steps = _disk(TOP_M, self.voxel_size)
        reach = int(np.abs(steps).max())
        window = np.zeros((2 * reach + 1,) * 2, bool)
        window[tuple((steps + reach).T)] = True
        tops = ndimage.maximum_filter(tops, footprint=window, mode="constant", cval=-np.inf)
        return np.where(np.isfinite(tops), tops, np.nan)

    def ground(self) -> np.ndarray:
        """(H, W) m above the grid's floor: lowest returns, freed of what stands on the ground.

        Columns without any take the nearest one's. A median takes single low returns away, and an
        opening all that is narrower than its window, also on a slope.
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
        return _moments(self.points_in, self.zyx, _ball(radius, self.voxel_size))

    def columns(self, ground: np.ndarray) -> dict[str, np.ndarray]:
        """What is above and below a voxel."""
        depth, _, width = self.solid.shape
        h, z = self.voxel_size, self.zyx[:, 0]
        column, of = np.unique(self.zyx[:, 1] * width + self.zyx[:, 2], return_inverse=True)
        yx = np.stack(np.divmod(column, width), axis=1).astype(np.int32)
        upright = np.ascontiguousarray(self.solid.transpose(1, 2, 0))
        floor = self.at(ground)
        values = {}
        for radius in (1.0, 2.0):
            filled = _union(upright, yx, _disk(radius, h))
            highest = np.where(filled.any(axis=1), depth - filled[:, ::-1].argmax(axis=1), 0)
            up, down = _runs(filled, int(RUN_GAP_M / h + 1e-9))
            # A stray return is in no run.
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
        """The columns around a voxel."""
        h, z, tops = self.voxel_size, self.middle, self.tops()
        stature, tall = tops - ground, np.full(len(self.zyx), TALL_M)

        def look(raster: np.ndarray, level: np.ndarray, outer: float, inner: float = -1.0):
            return _around(raster, self.zyx, level, _disk(outer, h, inner)).T

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
        """Numbers of points, in relation to the crop's: surveys differ in density."""
        columns = self.points_in.sum(axis=0)
        return {
            "points_2": np.log1p(near / np.median(near)),
            "column_points": np.log1p(self.at(columns) / np.median(columns[columns > 0])),
        }

    def wires(self, like: np.ndarray) -> dict[str, np.ndarray]:
        """Where the wire-like voxels ``like`` (M,) are."""
        wire = np.zeros(self.solid.shape[1:])
        z, y, x = self.zyx[like & self.kept].T
        np.add.at(wire, (y, x), self.voxel_size)
        distance = np.full(wire.shape, FARTHEST_WIRE_M)
        if len(z):
            apart = ndimage.distance_transform_edt(wire == 0) * self.voxel_size
            distance = np.minimum(apart, FARTHEST_WIRE_M)
        places = np.unique(self.zyx[like & self.kept][:, 1:], axis=0)
        length = _spread(wire, places, _disk(6.0, self.voxel_size))
        return {"wire_distance": self.at(distance), "wire_6": self.at(length)}


def _odd(metres: float, voxel_size: float) -> int:
    """Voxels of the window that is ``metres`` wide, at least one and with a middle."""
    return 2 * round(metres / voxel_size / 2) + 1


def _disk(outer: float, voxel_size: float, inner: float = -1.0) -> np.ndarray:
    """(K, 2) steps (y, x) to the columns more than ``inner`` and at most ``outer`` m away."""
    reach = int(outer / voxel_size + 1e-9)
    steps = np.arange(-reach, reach + 1)
    y, x = np.meshgrid(steps, steps, indexing="ij")
    apart = np.hypot(y, x) * voxel_size
    inside = (apart <= outer + 1e-9) & (apart > inner)
    return np.stack([y[inside], x[inside]], axis=1).astype(np.int32)


def _ball(radius: float, voxel_size: float) -> np.ndarray:
    """(K, 3) steps (z, y, x) to the voxels at most ``radius`` m away."""
    reach = int(radius / voxel_size + 1e-9)
    steps = np.arange(-reach, reach + 1)
    z, y, x = np.meshgrid(steps, steps, steps, indexing="ij")
    inside = np.sqrt(z * z + y * y + x * x) * voxel_size <= radius + 1e-9
    return np.stack([z[inside], y[inside], x[inside]], axis=1).astype(np.int32)


def _axes(moments: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Linearity, planarity and verticality, each (M,) in [0, 1], from ``_moments``.

    All are 0 where the voxels have no extent.
    """
    number = np.maximum(moments[:, 0], 1)[:, None]
    mean = moments[:, 1:4] / number
    covariance = np.empty((len(moments), 3, 3))
    for column, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)], start=4):
        spread = moments[:, column] / number[:, 0] - mean[:, i] * mean[:, j]
        covariance[:, i, j] = covariance[:, j, i] = spread
    lengths, axes = np.linalg.eigh(covariance)
    third, second, first = lengths.clip(min=0).T
    some = first > 1e-9
    largest = np.where(some, first, 1)
    linearity = np.where(some, (first - second) / largest, 0)
    planarity = np.where(some, (second - third) / largest, 0)
    return linearity, planarity, np.where(some, np.abs(axes[:, 0, 2]), 0)


@numba.njit(cache=True)
def _moments(points, zyx, steps):  # pragma: no cover - compiled
    """(M, 11): n, z, y, x, zz, yy, xx, zy, zx, yx, points, summed over the voxels at ``steps``."""
    depth, height, width = points.shape
    out = np.zeros((len(zyx), 11))
    for i in range(len(zyx)):
        for j in range(len(steps)):
            dz, dy, dx = steps[j, 0], steps[j, 1], steps[j, 2]
            z, y, x = zyx[i, 0] + dz, zyx[i, 1] + dy, zyx[i, 2] + dx
            if z < 0 or y < 0 or x < 0 or z >= depth or y >= height or x >= width:
                continue
            if points[z, y, x]:
                out[i, 0] += 1
                out[i, 1] += dz
                out[i, 2] += dy
                out[i, 3] += dx
                out[i, 4] += dz * dz
                out[i, 5] += dy * dy
                out[i, 6] += dx * dx
                out[i, 7] += dz * dy
                out[i, 8] += dz * dx
                out[i, 9] += dy * dx
                out[i, 10] += points[z, y, x]
    return out


@numba.njit(cache=True)
def _union(upright, yx, steps):  # pragma: no cover - compiled
    """(C, D) uint8: at which heights any of the columns at ``steps`` about a column is occupied."""
    height, width, depth = upright.shape
    out = np.zeros((len(yx), depth), np.uint8)
    for i in range(len(yx)):
        for j in range(len(steps)):
            y, x = yx[i, 0] + steps[j, 0], yx[i, 1] + steps[j, 1]
            if 0 <= y < height and 0 <= x < width:
                for z in range(depth):
                    out[i, z] |= upright[y, x, z]
    return out


@numba.njit(cache=True)
def _runs(filled, gap):  # pragma: no cover - compiled
    """Heights that the run at each place has upwards and downwards, itself included, (C, D) twice.

    A run goes on over up to ``gap`` empty heights; in these it has no length.
    """
    n, depth = filled.shape
    up, down = np.zeros((n, depth), np.int32), np.zeros((n, depth), np.int32)
    for i in range(n):
        first, last = -1, -1
        for z in range(depth):
            if filled[i, z]:
                if last < 0 or z - last > gap + 1:
                    first = z
                last = z
                down[i, z] = z - first + 1
        first, last = -1, -1
        for z in range(depth - 1, -1, -1):
            if filled[i, z]:
                if last < 0 or last - z > gap + 1:
                    first = z
                last = z
                up[i, z] = first - z + 1
    return up, down


@numba.njit(cache=True)
def _around(raster, zyx, level, steps):  # pragma: no cover - compiled
    """(M, 3): of the places at ``steps``, the share that reaches ``level``, the mean, the highest.

    NaN places do not count; where no other is, the mean and the highest are ``level``.
    """
    height, width = raster.shape
    out = np.zeros((len(zyx), 3))
    for i in range(len(zyx)):
        n, reach, total, highest = 0, 0, 0.0, -np.inf
        for j in range(len(steps)):
            y, x = zyx[i, 1] + steps[j, 0], zyx[i, 2] + steps[j, 1]
            if y < 0 or x < 0 or y >= height or x >= width or np.isnan(raster[y, x]):
                continue
            n += 1
            total += raster[y, x]
            reach += raster[y, x] >= level[i]
            highest = max(highest, raster[y, x])
        if n:
            out[i, 0], out[i, 1], out[i, 2] = reach / n, total / n, highest
        else:
            out[i, 1], out[i, 2] = level[i], level[i]
    return out


@numba.njit(cache=True)
def _spread(raster, places, steps):  # pragma: no cover - compiled
    """(H, W): for each place the sum of ``raster`` over the ``places`` (P, 2) within ``steps``."""
    height, width = raster.shape
    out = np.zeros((height, width))
    for i in range(len(places)):
        for j in range(len(steps)):
            y, x = places[i, 0] + steps[j, 0], places[i, 1] + steps[j, 1]
            if 0 <= y < height and 0 <= x < width:
                out[y, x] += raster[places[i, 0], places[i, 1]]
    return out
