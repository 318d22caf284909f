"""Runs of voxels: four neighbours along x, with the pattern of the occupied ones."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from scenenet.core.compilation import COMPILED

RUN = 4
"""Voxels in a run. With kernels up to 13 wide, a run adds 16 numbers to a row of the response: one
vector. Real crops have 2.4 times fewer runs than voxels."""


class Runs(NamedTuple):
    """The runs of a batch of B grids (D, H, W), plane by plane.

    Attributes:
        y: (R,) int32.
        x: (R,) int32, x of the first voxel of the run.
        pattern: (R,) int32, bit i set where voxel x + i is occupied.
        value: (R,) float64, the measurement phi of its voxels.
        planes: (B * D + 1,) int64, plane p of the batch has runs planes[p] to planes[p + 1].
        shape: (3,) int64: D, H, W. An array, because parallel compiled loops cannot take a tuple
            within a tuple.
    """

    y: np.ndarray
    x: np.ndarray
    pattern: np.ndarray
    value: np.ndarray
    planes: np.ndarray
    shape: np.ndarray


def runs_of(
    index: np.ndarray, values: np.ndarray | None, offsets: np.ndarray, shape: tuple[int, int, int]
) -> Runs:
    """The runs of a batch.

    Args:
        index: (M,) int64 flat positions in (D, H, W), ascending within each grid.
        values: (M,) float, or None if every value is one. With values each voxel is a run of its
            own, because a pattern has no values.
        offsets: (B + 1,) int64, grid b holds rows offsets[b] to offsets[b + 1].
    """
    some = np.empty(0) if values is None else values.astype(np.float64, copy=False)
    y, x, pattern, value, planes = _gather(index, some, values is not None, offsets, shape)
    return Runs(y, x, pattern, value, planes, np.array(shape, np.int64))


@numba.njit(**COMPILED)
def _gather(index, values, valued, offsets, shape):  # pragma: no cover - compiled
    depth, height, width = shape
    n_runs = len(index)
    y, x = np.empty(n_runs, np.int32), np.empty(n_runs, np.int32)
    pattern, value = np.empty(n_runs, np.int32), np.ones(n_runs, np.float64)
    planes = np.zeros((len(offsets) - 1) * depth + 1, np.int64)
    r = -1
    for b in range(len(offsets) - 1):
        begin, plane_ends, row_ends = np.int64(-1), np.int64(-1), np.int64(-1)
        plane = row = np.int64(0)
        for i in range(offsets[b], offsets[b + 1]):
            # Flat positions ascend, so a division is only needed when a plane or a row ends.
            if index[i] >= plane_ends:
                plane = index[i] // (height * width)
                plane_ends = (plane + 1) * height * width
                row_ends = np.int64(-1)
            if index[i] >= row_ends:
                row = (index[i] - plane * height * width) // width
                row_ends = plane * height * width + (row + 1) * width
                begin = np.int64(-1)
            across = index[i] - row_ends + width
            if begin < 0 or across >= begin + RUN or valued:
                r += 1
                begin = across if valued else across // RUN * RUN
                y[r], x[r], pattern[r] = row, begin, 0
                if valued:
                    value[r] = values[i]
                planes[b * depth + plane + 1] += 1
            pattern[r] |= 1 << (across - begin)
    n_runs = r + 1
    for p in range(len(planes) - 1):
        planes[p + 1] += planes[p]
    return y[:n_runs], x[:n_runs], pattern[:n_runs], value[:n_runs], planes
