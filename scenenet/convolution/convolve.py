"""The convolution over occupied voxels, where most of the time is spent (thesis 4.1).

Only 1 to 2 % of the voxels of a grid are occupied, so a grid is a list of its occupied voxels, and
each of them adds the kernel, mirrored about its anchor, to the output around it. This is the same
sum as ``torch.nn.functional.conv3d(padding="same")`` on the dense grid, in another order:

    out[p] = sum_q kernel[q] * x[p + q - a],   a = (k - 1) // 2 on each axis

with x = 0 outside the grid. An even kernel extends one voxel further up each axis than down.
``docs/method/performance.md`` explains its speed.
"""

from __future__ import annotations

import numba
import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.compiled.kernel_tables import kernel_of, lanes_of, table_of
from scenenet.convolution.compiled.options import TASKS, first_plane
from scenenet.convolution.compiled.planes import gather_plane, layout, sum_plane
from scenenet.convolution.compiled.runs import RUN
from scenenet.convolution.compiled.volumes import fill_volume
from scenenet.convolution.occupancy import Occupancy, Shape
from scenenet.core.compilation import COMPILED


def convolve(occupancy: Occupancy, kernel: Tensor) -> Tensor:
    """Convolve each grid with ``kernel``; differentiable in the kernel.

    The observer is linear (thesis Eq. 4.1), so a weighted sum of kernels needs one convolution.

    Args:
        occupancy: B grids of shape (D, H, W).
        kernel: (kz, ky, kx), or (K, kz, ky, kx) for K kernels, float32 or float64; each side may be
            odd or even.

    Returns:
        (B, D, H, W), or (K, B, D, H, W), of the kernel's dtype.
    """
    if kernel.dim() == 4:
        return torch.stack([convolve(occupancy, one) for one in kernel])
    return _Convolution.apply(kernel, occupancy)


def convolve_at_voxels(
    occupancy: Occupancy, kernels: Tensor, at: np.ndarray | None = None
) -> Tensor:
    """The result of ``convolve`` at some voxels only, without a volume; no gradient.

    Args:
        kernels: (K, kz, ky, kx), float32 or float64.
        at: (M,) the voxels, ascending, as ``Occupancy.flat`` numbers them; None for the occupied
            ones.

    Returns:
        (K, M), in the order of ``at``.
    """
    weights = np.ascontiguousarray(kernels.detach().numpy())
    flat = occupancy.flat() if at is None else at
    index = occupancy.index if at is None else at % int(np.prod(occupancy.shape))
    out = np.empty((len(weights), len(flat)), weights.dtype)
    rows = occupancy.plane_rows(flat)
    for k, kernel in enumerate(weights):
        table = table_of(kernel)
        _pick(occupancy.runs, table, kernel.shape[2], index, rows, out[k])
    return torch.from_numpy(out)


class _Convolution(torch.autograd.Function):
    @staticmethod
    def forward(ctx, kernel: Tensor, occupancy: Occupancy) -> Tensor:
        ctx.occupancy = occupancy
        ctx.kernel_size = tuple(kernel.shape)
        weights = np.ascontiguousarray(kernel.detach().numpy())
        out = np.empty((len(occupancy), *occupancy.shape), weights.dtype)
        none = weights.dtype.type(0)
        fill_volume(occupancy.runs, table_of(weights), weights.shape[2], none, False, out)
        return torch.from_numpy(out)

    @staticmethod
    def backward(ctx, upstream: Tensor) -> tuple[Tensor, None]:
        return convolution_gradient(ctx.occupancy, upstream, ctx.kernel_size), None


def convolution_gradient(occupancy: Occupancy, upstream: Tensor, size: Shape) -> Tensor:
    """Gradient of sum(upstream * convolve(occupancy, kernel)) with respect to the kernel.

    Args:
        upstream: (B, D, H, W), float32 or float64.
        size: (kz, ky, kx) of the kernel.
    """
    dense = np.ascontiguousarray(upstream.numpy())
    tables = np.zeros((TASKS, *table_shape(size)), dense.dtype)
    _gather(occupancy.runs, dense, size[2], tables)
    return torch.from_numpy(kernel_of(tables, size[2]))


def table_shape(size: Shape) -> tuple[int, int, int, int]:
    """Shape of the table of a kernel of ``size``
    (``scenenet.convolution.compiled.kernel_tables``)."""
    kz, ky, kx = size
    return kz, 1 << RUN, ky, lanes_of(kx)


@numba.njit(parallel=True, **COMPILED)
def _gather(runs, upstream, kx, tables):  # pragma: no cover - compiled
    """tables[task] += gradient of the table from the planes of a task."""
    depth, height, width = runs.shape
    n_rows, length, above, left = layout(tables[0], kx, height, width)
    for task in numba.prange(TASKS):
        buffer = np.zeros(n_rows * length, tables.dtype)
        for p in range(first_plane(task), len(runs.planes) - 1, TASKS):
            plane = upstream[p // depth, p % depth]
            for y in range(height):
                begin = (y + above) * length + left
                for x in range(width):
                    buffer[begin + x] = plane[y, x]
            gather_plane(p, runs, buffer, length, tables[task])


@numba.njit(parallel=True, **COMPILED)
def _pick(runs, table, kx, index, rows, out):  # pragma: no cover - compiled
    """out[i] = the response at voxel i; only planes with an occupied voxel are computed."""
    depth, height, width = runs.shape
    n_rows, length, above, left = layout(table, kx, height, width)
    for task in numba.prange(TASKS):
        buffer = np.empty(n_rows * length, table.dtype)
        reached = np.empty(height, np.bool_)
        for p in range(first_plane(task), len(runs.planes) - 1, TASKS):
            if rows[p] == rows[p + 1]:
                continue
            sum_plane(p, runs, table, buffer, length, reached)
            for i in range(rows[p], rows[p + 1]):
                within = index[i] - (p % depth) * height * width
                y = within // width
                out[i] = buffer[(y + above) * length + left + within - y * width]
