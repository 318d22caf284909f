"""Sums over the voxels and columns around a voxel: the windows, and compiled loops over them.

A window is a list of steps, so that a disk and a ball cost no more than what they hold.
"""

from __future__ import annotations

import numba
import numpy as np


def disk(outer: float, voxel_size: float, inner: float = -1.0) -> np.ndarray:
    """(K, 2) steps (y, x) to the columns more than ``inner`` and at most ``outer`` m away."""
    reach = int(outer / voxel_size + 1e-9)
    steps = np.arange(-reach, reach + 1)
    y, x = np.meshgrid(steps, steps, indexing="ij")
    distance = np.hypot(y, x) * voxel_size
    inside = (distance <= outer + 1e-9) & (distance > inner)
    return np.stack([y[inside], x[inside]], axis=1).astype(np.int32)


def ball(radius: float, voxel_size: float) -> np.ndarray:
    """(K, 3) steps (z, y, x) to the voxels at most ``radius`` m away."""
    reach = int(radius / voxel_size + 1e-9)
    steps = np.arange(-reach, reach + 1)
    z, y, x = np.meshgrid(steps, steps, steps, indexing="ij")
    inside = np.sqrt(z * z + y * y + x * x) * voxel_size <= radius + 1e-9
    return np.stack([z[inside], y[inside], x[inside]], axis=1).astype(np.int32)


@numba.njit(cache=True)
def moments(points, zyx, steps):  # pragma: no cover - compiled
    """(M, 11): sums of 1, z, y, x, zz, yy, xx, zy, zx, yx and points over the voxels at ``steps``
    from each voxel."""
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
def union(upright, yx, steps):  # pragma: no cover - compiled
    """(C, D) uint8: heights at which any of the columns at ``steps`` from a column is occupied."""
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
def runs(filled, gap):  # pragma: no cover - compiled
    """Length of the run at each height upwards and downwards, itself included, two (C, D) arrays.

    A run may contain gaps of up to ``gap`` empty heights; the length is 0 at empty heights.
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
def around(raster, zyx, level, steps):  # pragma: no cover - compiled
    """(M, 3): over the columns at ``steps``, the share that reaches ``level``, the mean and the
    maximum.

    Columns with NaN do not count; without any other, the mean and the maximum are ``level``.
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
def spread(raster, places, steps):  # pragma: no cover - compiled
    """(H, W): at each column the sum of ``raster`` over the ``places`` (P, 2) within ``steps``."""
    height, width = raster.shape
    out = np.zeros((height, width))
    for i in range(len(places)):
        for j in range(len(steps)):
            y, x = places[i, 0] + steps[j, 0], places[i, 1] + steps[j, 1]
            if 0 <= y < height and 0 <= x < width:
                out[y, x] += raster[places[i, 0], places[i, 1]]
    return out
