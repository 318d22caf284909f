"""The height of a voxel above the ground, without class codes."""

from __future__ import annotations

import math

import numpy as np

AROUND_M = 6.0
"""The ground below a voxel is the lowest occupied voxel this far to each side, m: crowns and roofs
are rarely wider without a return from below them, and wider, a slope counts as height."""


def columns_around(voxel_size: float) -> int:
    """Voxels to each side in which the ground is looked for."""
    return math.ceil(AROUND_M / voxel_size)


def heights(zyx: np.ndarray, around: np.ndarray, voxel_size: float) -> np.ndarray:
    """(M,) m, how far each voxel lies above the lowest voxel around it.

    Args:
        zyx: (M, 3) positions of voxels on a lattice.
        around: (K, 3) positions of all occupied voxels in the columns around them, their own
            included.
        voxel_size: m.
    """
    from scipy import ndimage

    if len(zyx) == 0:
        return np.empty(0)
    low = around[:, 1:].min(axis=0)
    lowest = np.full(around[:, 1:].max(axis=0) - low + 1, np.inf)
    at = tuple((around[:, 1:] - low).T)
    np.minimum.at(lowest, at, around[:, 0].astype(float))
    ground = ndimage.minimum_filter(lowest, size=2 * columns_around(voxel_size) + 1, mode="nearest")
    return (zyx[:, 0] - ground[tuple((zyx[:, 1:] - low).T)]) * voxel_size
