"""Compiled loops that count points in voxels."""

from __future__ import annotations

import math

import numba
import numpy as np

from scenenet.core.compilation import COMPILED


@numba.njit(**(COMPILED | {"fastmath": {"nnan", "nsz"}}))
def extremes(xyz):  # pragma: no cover - compiled
    """Minimum and maximum (3,) of each column of points (N, 3). NaN is not handled: the readers
    refuse it, and the check would take twice as long."""
    low_x, low_y, low_z = high_x, high_y, high_z = xyz[0, 0], xyz[0, 1], xyz[0, 2]
    for i in range(len(xyz)):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        low_x, low_y, low_z = min(low_x, x), min(low_y, y), min(low_z, z)
        high_x, high_y, high_z = max(high_x, x), max(high_y, y), max(high_z, z)
    return np.array([low_x, low_y, low_z]), np.array([high_x, high_y, high_z])


@numba.njit(parallel=True, **COMPILED)
def voxel_of(xyz, origin, voxel_size, nz, ny, nx):  # pragma: no cover - compiled
    """(N,) flat [z, y, x] index of the voxel of each point (N, 3), clipped to the grid."""
    voxel = np.empty(len(xyz), np.int64)
    for i in numba.prange(len(xyz)):
        x = min(nx - 1, max(0, math.floor((xyz[i, 0] - origin[0]) / voxel_size)))
        y = min(ny - 1, max(0, math.floor((xyz[i, 1] - origin[1]) / voxel_size)))
        z = min(nz - 1, max(0, math.floor((xyz[i, 2] - origin[2]) / voxel_size)))
        voxel[i] = (z * ny + y) * nx + x
    return voxel


@numba.njit(**COMPILED)
def tally(voxel, tower, n_voxels):  # pragma: no cover - compiled
    """Occupied voxels, ascending, with the number of points in each and whether any is a tower
    point.

    One bit per voxel marks the occupied ones. The number of bits set before a voxel's bit is its
    position in the result, so nothing is sorted, and only the bits are as large as the grid.

    Args:
        voxel: (N,) int64 flat index of the voxel of each point.
        tower: (N,) bool, whether each point is labelled tower.
        n_voxels: voxels of the grid.

    Returns:
        (M,) int32 flat indices, (M,) int32 numbers of points, (M,) bool.
    """
    one = np.uint64(1)
    bits = np.zeros((n_voxels + 63) // 64, np.uint64)
    for v in voxel:
        bits[v >> 6] |= one << np.uint64(v & 63)
    before = np.empty(len(bits), np.int64)
    occupied = 0
    for word in range(len(bits)):
        before[word] = occupied
        occupied += _ones(bits[word])
    index = np.empty(occupied, np.int32)
    count, found = np.zeros(occupied, np.int32), np.zeros(occupied, np.bool_)
    for i in range(len(voxel)):
        v = voxel[i]
        below = bits[v >> 6] & ((one << np.uint64(v & 63)) - one)
        place = before[v >> 6] + _ones(below)
        index[place] = v
        count[place] += 1
        found[place] |= tower[i]
    return index, count, found


@numba.njit(**COMPILED)
def _ones(word):  # pragma: no cover - compiled
    """Number of bits set in a uint64: counted in pairs, then fours, then bytes, in parallel."""
    word = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    fours = np.uint64(0x3333333333333333)
    word = (word & fours) + ((word >> np.uint64(2)) & fours)
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))
