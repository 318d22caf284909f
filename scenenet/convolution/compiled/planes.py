"""One horizontal plane of the response, in a buffer that stays in the first-level cache.

The buffer has a border, wide enough for what a voxel adds beyond the edge of the grid, so the loops
need no test for the edge. Output (y, x) is at row y + ``above``, column x + ``left`` of the buffer.
"""

from __future__ import annotations

import numba

from scenenet.convolution.compiled.rows import add_rows
from scenenet.convolution.compiled.runs import RUN
from scenenet.core.compilation import COMPILED


@numba.njit(**COMPILED)
def layout(table, kx, height, width):  # pragma: no cover - compiled
    """(rows, row length, above, left) of the buffer for a plane (height, width)."""
    ky, lanes = table.shape[-2:]
    above, left = ky - 1 - (ky - 1) // 2, kx - 1 - (kx - 1) // 2
    # The last run starts at the last multiple of RUN and writes all its lanes.
    return height + ky - 1, (width + RUN - 1) // RUN * RUN + lanes, above, left


@numba.njit(**COMPILED)
def sum_plane(p, runs, table, buffer, row_length, reached):  # pragma: no cover - compiled
    """Compute plane ``p`` of the batch from the occupied voxels of its grid.

    Args:
        table: of ``scenenet.convolution.compiled.kernel_tables``, (kz, 2^RUN, ky, lanes).
        buffer: 1D, overwritten.
        reached: (H,) bool, overwritten: whether any voxel contributes to the row. Other rows are 0.

    Returns:
        whether any row is reached.
    """
    kz, patterns, ky, lanes = table.shape
    flat = table.reshape(-1)
    depth = runs.shape[0]
    first = p - p % depth
    buffer[:] = 0
    reached[:] = False
    occupied = False
    for qz in range(kz):
        source = p + qz - (kz - 1) // 2
        if source < first or source >= first + depth:
            continue
        for i in range(runs.planes[source], runs.planes[source + 1]):
            occupied = True
            reached[runs.y[i]] = True
            factor = table.dtype.type(runs.value[i])
            to = runs.y[i] * row_length + runs.x[i]
            # The kernel's last row goes to row y of the buffer, its first row to y + ky - 1.
            row = ((qz * patterns + runs.pattern[i]) * ky + ky - 1) * lanes
            add_rows(buffer, to, row_length, flat, row, -lanes, ky, lanes, factor)
    if occupied:
        _widen(reached, ky - 1 - (ky - 1) // 2, (ky - 1) // 2)
    return occupied


@numba.njit(**COMPILED)
def gather_plane(p, runs, upstream, row_length, table):  # pragma: no cover - compiled
    """The transpose of ``sum_plane``: add the gradient of plane ``p`` to that of the table.

    Args:
        upstream: 1D, the gradient of the plane in a buffer's layout, with a border of zeros.
        table: (kz, 2^RUN, ky, lanes), added to.
    """
    kz, patterns, ky, lanes = table.shape
    flat = table.reshape(-1)
    depth = runs.shape[0]
    first = p - p % depth
    for qz in range(kz):
        source = p + qz - (kz - 1) // 2
        if source < first or source >= first + depth:
            continue
        for i in range(runs.planes[source], runs.planes[source + 1]):
            factor = table.dtype.type(runs.value[i])
            at = runs.y[i] * row_length + runs.x[i]
            row = ((qz * patterns + runs.pattern[i]) * ky + ky - 1) * lanes
            add_rows(flat, row, -lanes, upstream, at, row_length, ky, lanes, factor)


@numba.njit(**COMPILED)
def _widen(flags, before, behind):  # pragma: no cover - compiled
    """Set every flag from ``before`` places before a set flag to ``behind`` places after it."""
    was = flags.copy()
    for i in range(len(flags)):
        if was[i]:
            flags[max(0, i - before) : min(len(flags), i + behind + 1)] = True
