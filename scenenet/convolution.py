"""The occupancy convolution: the one hot loop of the project (thesis 4.1).

A voxel grid is 1-2 % full, so it is kept as the list of its occupied voxels, and each occupied
voxel adds the kernel, mirrored about its anchor, to the output around it. That is the same sum as
``torch.nn.functional.conv3d(padding="same")`` on the dense grid, in another order:

    out[p] = sum_q kernel[q] * x[p + q - a],   a = (k - 1) // 2 on each axis

with x = 0 outside the grid. An even kernel reaches one voxel further up each axis than down.
``docs/performance.md`` tells how fast it is and why. A kernel on a GPU is convolved there, densely.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np
import torch
from torch import Tensor

from scenenet.engine.options import COMPILED, TASKS, first_plane
from scenenet.engine.planes import gather_plane, layout, sum_plane
from scenenet.engine.runs import RUN, Runs, runs_of
from scenenet.engine.tables import kernel_of, lanes_of, table_of

Shape = tuple[int, int, int]
"""(D, H, W): voxels along z, y, x."""


@dataclass(frozen=True)
class Occupancy:
    """A batch of sparse voxel grids of one shape.

    Attributes:
        index: (M,) int64, flat C-order positions in (D, H, W) of the occupied voxels of all grids,
            one grid after the other, ascending within a grid.
        values: (M,) floats, the measurement phi there (thesis 4.2.2); None where all are one.
        offsets: (B + 1,) int64, grid b holds rows offsets[b] to offsets[b + 1].
        shape: (D, H, W) of every grid: axes z, y, x.
    """

    index: np.ndarray
    values: np.ndarray | None
    offsets: np.ndarray
    shape: Shape

    def __post_init__(self) -> None:
        if not _well_formed(self.index, self.offsets, int(np.prod(self.shape))):
            raise ValueError(
                f"positions must be distinct, ascending within each grid and inside {self.shape}"
            )

    @classmethod
    def of_grids(
        cls,
        indices: Sequence[np.ndarray],
        values: Sequence[np.ndarray] | None,
        shape: Shape,
    ) -> Occupancy:
        """Gather grids given by flat C-order indices (M_b,) and their values (M_b,).

        Args:
            indices: ascending and without duplicates, each.
            values: None where all are one.
            shape: (D, H, W) of every grid.

        Raises:
            ValueError: an index is out of order, comes twice or lies outside the grid.
        """
        offsets = np.zeros(len(indices) + 1, np.int64)
        np.cumsum([len(index) for index in indices], out=offsets[1:])
        index = np.concatenate([*indices, np.empty(0, np.int64)]).astype(np.int64, copy=False)
        joined = None
        if values is not None:
            joined = np.concatenate([np.asarray(v) for v in [*values, np.empty(0, np.float32)]])
        return cls(index, joined, offsets, shape)

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def n_voxels(self) -> int:
        """Voxels of all grids, empty ones included."""
        return len(self) * int(np.prod(self.shape))

    @cached_property
    def runs(self) -> Runs:
        """The same voxels, as the loops take them."""
        return runs_of(self.index, self.values, self.offsets, self.shape)

    def flat(self) -> np.ndarray:
        """(M,) int64 positions in a (B, D, H, W) volume."""
        grid = np.repeat(np.arange(len(self)), np.diff(self.offsets))
        return self.index + grid * int(np.prod(self.shape))

    def dense(self, dtype: torch.dtype | None = None, device: torch.device | None = None) -> Tensor:
        """(B, D, H, W) tensor of the same grids; of the values' type unless told."""
        values = np.ones(len(self.index), np.float32) if self.values is None else self.values
        entries = torch.from_numpy(values).to(device, dtype)
        volume = torch.zeros(self.n_voxels, dtype=entries.dtype, device=device)
        volume[torch.from_numpy(self.flat()).to(device)] = entries
        return volume.reshape(len(self), *self.shape)


def convolve(occupancy: Occupancy, kernel: Tensor) -> Tensor:
    """Convolve each grid with ``kernel``; differentiable in the kernel.

    The observer is linear (thesis Eq. 4.1), so the weighted sum of kernels is convolved once, and
    the volumes of the single ones need not be made.

    Args:
        occupancy: B grids of shape (D, H, W).
        kernel: (kz, ky, kx), or K of them as (K, kz, ky, kx), float32 or float64, any size, odd or
            even.

    Returns:
        (B, D, H, W), or (K, B, D, H, W), of the kernel's dtype and on its device.
    """
    if kernel.dim() == 4:
        return torch.stack([convolve(occupancy, one) for one in kernel])
    if kernel.is_cuda:
        return convolve_dense(occupancy, kernel)
    return _Convolution.apply(kernel, occupancy)


def convolve_dense(occupancy: Occupancy, kernel: Tensor) -> Tensor:
    """``convolve`` of one kernel, as torch does it on dense grids: what runs on a GPU.

    A GPU does a 9x9x9 kernel's multiply-adds on all voxels of a grid faster than it finds its way
    through a list, and without the atomic additions that would make sums differ from run to run.
    """
    volume = occupancy.dense(kernel.dtype, kernel.device)[:, None]
    kz, ky, kx = kernel.shape
    # Padded by hand, because torch warns of what padding="same" costs with even sizes.
    borders = [(k - 1) // 2 if low else k // 2 for k in (kx, ky, kz) for low in (True, False)]
    padded = torch.nn.functional.pad(volume, borders)
    return torch.nn.functional.conv3d(padded, kernel[None, None])[:, 0]


def convolve_at_voxels(occupancy: Occupancy, kernels: Tensor) -> Tensor:
    """What ``convolve`` answers at the occupied voxels, without a volume; no gradient.

    Args:
        kernels: (K, kz, ky, kx), float32 or float64, on the CPU.

    Returns:
        (K, M), in the order of ``occupancy.index``.
    """
    weights = np.ascontiguousarray(kernels.detach().numpy())
    out = np.empty((len(weights), len(occupancy.index)), weights.dtype)
    rows = _plane_rows(occupancy)
    for k, kernel in enumerate(weights):
        table = table_of(kernel)
        _pick(occupancy.runs, table, kernel.shape[2], occupancy.index, rows, out[k])
    return torch.from_numpy(out)


class _Convolution(torch.autograd.Function):
    @staticmethod
    def forward(ctx, kernel: Tensor, occupancy: Occupancy) -> Tensor:
        ctx.occupancy = occupancy
        ctx.kernel_size = tuple(kernel.shape)
        weights = np.ascontiguousarray(kernel.detach().numpy())
        out = np.empty((len(occupancy), *occupancy.shape), weights.dtype)
        _scatter(occupancy.runs, table_of(weights), weights.shape[2], out)
        return torch.from_numpy(out)

    @staticmethod
    def backward(ctx, upstream: Tensor) -> tuple[Tensor, None]:
        return convolution_gradient(ctx.occupancy, upstream, ctx.kernel_size), None


def convolution_gradient(occupancy: Occupancy, upstream: Tensor, size: Shape) -> Tensor:
    """Gradient of sum(upstream * convolve(occupancy, kernel)) with respect to the kernel.

    Args:
        upstream: (B, D, H, W), float32 or float64, on the CPU.
        size: (kz, ky, kx) of the kernel.
    """
    dense = np.ascontiguousarray(upstream.numpy())
    tables = np.zeros((TASKS, *table_shape(size)), dense.dtype)
    _gather(occupancy.runs, dense, size[2], tables)
    return torch.from_numpy(kernel_of(tables, size[2]))


def table_shape(size: Shape) -> tuple[int, int, int, int]:
    """Shape of the table of a kernel of ``size`` (see ``scenenet.engine.tables``)."""
    kz, ky, kx = size
    return kz, 1 << RUN, ky, lanes_of(kx)


@numba.njit(parallel=True, **COMPILED)
def _scatter(runs, table, kx, out):  # pragma: no cover - compiled
    """out[b, z] = the plane, for each plane of the batch."""
    depth, height, width = runs.shape
    n_rows, length, above, left = layout(table, kx, height, width)
    for task in numba.prange(TASKS):
        buffer = np.empty(n_rows * length, table.dtype)
        reached = np.empty(height, np.bool_)
        for p in range(first_plane(task), len(runs.planes) - 1, TASKS):
            plane = out[p // depth, p % depth]
            if not sum_plane(p, runs, table, buffer, length, reached):
                plane[:] = 0
                continue
            for y in range(height):
                begin = (y + above) * length + left
                for x in range(width):
                    plane[y, x] = buffer[begin + x]


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
    """out[i] = the answer at voxel i; only planes with an occupied voxel are summed up."""
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


def _plane_rows(occupancy: Occupancy) -> np.ndarray:
    """(B * D + 1,) int64: the voxels of plane p are rows [p] to [p + 1] of ``index``."""
    depth, height, width = occupancy.shape
    starts = np.arange(len(occupancy) * depth + 1) * height * width
    return np.searchsorted(occupancy.flat(), starts)


@numba.njit(**COMPILED)
def _well_formed(index, offsets, n_voxels):  # pragma: no cover - compiled
    for b in range(len(offsets) - 1):
        before = -1
        for i in range(offsets[b], offsets[b + 1]):
            if index[i] <= before or index[i] >= n_voxels:
                return False
            before = index[i]
    return True
