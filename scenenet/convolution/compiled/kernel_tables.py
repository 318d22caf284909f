"""What each pattern of a run adds to the response, and the reverse for the gradient.

Lane l of a row belongs to the output at x + l - (kx - 1) + (kx - 1) // 2, x the run's first voxel.
"""

from __future__ import annotations

import numba
import numpy as np

from scenenet.convolution.compiled.rows import LANES
from scenenet.convolution.compiled.runs import RUN
from scenenet.core.compilation import COMPILED


def lanes_of(kernel_width: int) -> int:
    """Numbers that a run adds to a row of the response, rounded up to whole vector rows."""
    return -(-(RUN + kernel_width - 1) // LANES) * LANES


@numba.njit(**COMPILED)
def table_of(kernel):  # pragma: no cover - compiled
    """The table (kz, 2^RUN, ky, lanes) of a kernel (kz, ky, kx), with one row for each pattern.

    The row of a pattern is the row of the pattern without its lowest voxel, plus the row of that
    voxel alone.
    """
    kz, ky, kx = kernel.shape
    lanes = (RUN + kx - 1 + LANES - 1) // LANES * LANES
    table = np.zeros((kz, 1 << RUN, ky, lanes), kernel.dtype)
    for qz in range(kz):
        for pattern in range(1, 1 << RUN):
            lowest = _lowest_bit(pattern)
            others = pattern & (pattern - 1)
            for qy in range(ky):
                for lane in range(lanes):
                    table[qz, pattern, qy, lane] = table[qz, others, qy, lane]
                for qx in range(kx):
                    table[qz, pattern, qy, lowest + kx - 1 - qx] += kernel[qz, qy, qx]
    return table


@numba.njit(**COMPILED)
def kernel_of(tables, kx):  # pragma: no cover - compiled
    """The transpose of ``table_of``: the gradient of a kernel from that of its table.

    Args:
        tables: (parts, kz, 2^RUN, ky, lanes), overwritten; the parts are summed in order.
        kx: width of the kernel.
    """
    parts, kz, _, ky, _ = tables.shape
    total = tables[0].reshape(-1)
    for part in range(1, parts):
        added = tables[part].reshape(-1)
        for i in range(len(total)):
            total[i] += added[i]
    kernel = np.zeros((kz, ky, kx), tables.dtype)
    for qz in range(kz):
        for pattern in range(1, 1 << RUN):
            for voxel in range(RUN):
                if not (pattern >> voxel) & 1:
                    continue
                for qy in range(ky):
                    for qx in range(kx):
                        kernel[qz, qy, qx] += tables[0, qz, pattern, qy, voxel + kx - 1 - qx]
    return kernel


@numba.njit(**COMPILED)
def _lowest_bit(pattern):  # pragma: no cover - compiled
    bit = 0
    while not (pattern >> bit) & 1:
        bit += 1
    return bit
