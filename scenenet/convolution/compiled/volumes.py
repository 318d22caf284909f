"""All planes of the output, with or without activation."""

from __future__ import annotations

import numba
import numpy as np

from scenenet.convolution.compiled.activation import activate
from scenenet.convolution.compiled.options import TASKS, first_plane
from scenenet.convolution.compiled.planes import layout, sum_plane
from scenenet.core.compilation import COMPILED


@numba.njit(parallel=True, **COMPILED)
def fill_volume(runs, table, kx, bias, activated, out):  # pragma: no cover - compiled
    """Write the response of a kernel, or the probability, of every voxel of the batch.

    Args:
        table: of ``scenenet.convolution.compiled.kernel_tables``, (kz, 2^RUN, ky, lanes).
        kx: width of the kernel.
        bias: added before the activation; ignored without one.
        activated: whether to write (tanh(response + bias))_+ instead of the response.
        out: (B, D, H, W), overwritten.
    """
    depth, height, width = runs.shape
    n_rows, length, above, left = layout(table, kx, height, width)
    for task in numba.prange(TASKS):
        buffer = np.empty(n_rows * length, table.dtype)
        reached = np.empty(height, np.bool_)
        for p in range(first_plane(task), len(runs.planes) - 1, TASKS):
            plane = out[p // depth, p % depth]
            sum_plane(p, runs, table, buffer, length, reached)
            for y in range(height):
                begin = (y + above) * length + left
                row = buffer[begin : begin + width]
                if not activated:
                    copy_row(row, plane[y])
                elif reached[y]:
                    activate_row(row, bias, plane[y])
                else:
                    fill_row(activate(bias), plane[y])


@numba.njit(**COMPILED)
def activate_row(responses, bias, out):  # pragma: no cover - compiled
    """out = (tanh(responses + bias))_+, for as many numbers as ``out`` has."""
    for x in range(len(out)):
        out[x] = activate(responses[x] + bias)


# Loops, because numba compiles a check of shapes, with its message, into each assignment to a row.


@numba.njit(**COMPILED)
def copy_row(values, out):  # pragma: no cover - compiled
    for x in range(len(out)):
        out[x] = values[x]


@numba.njit(**COMPILED)
def fill_row(value, out):  # pragma: no cover - compiled
    for x in range(len(out)):
        out[x] = value
