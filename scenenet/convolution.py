"""The occupancy convolution: the one hot loop of the project (thesis 4.1).

A voxel grid is 1-2 % full, so it is kept as the list of its occupied voxels, and each occupied
voxel adds the kernel, mirrored about its anchor, to the output around it. That is the same sum as
``torch.nn.functional.conv3d(padding="same")`` on the dense grid, in another order:

    out[p] = sum_q kernel[q] * x[p + q - a],   a = (k - 1) // 2 on each axis

with x = 0 outside the grid. An even kernel reaches one voxel further up each axis than down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
import torch
from torch import Tensor

Shape = tuple[int, int, int]
"""(D, H, W): voxels along z, y, x."""


@dataclass(frozen=True)
class Occupancy:
    """A batch of sparse voxel grids of one shape.

    Attributes:
        zyx: (M, 3) int32, the occupied voxels of all grids, one grid after the other.
        values: (M,) float32 or float64, the measurement phi there (thesis 4.2.2).
        offsets: (B + 1,) int64, grid b holds rows offsets[b] to offsets[b + 1].
        shape: (D, H, W) of every grid: axes z, y, x.
    """

    zyx: np.ndarray
    values: np.ndarray
    offsets: np.ndarray
    shape: Shape

    @classmethod
    def of_grids(
        cls,
        indices: Sequence[np.ndarray],
        values: Sequence[np.ndarray],
        shape: Shape,
    ) -> Occupancy:
        """Gather grids given by flat C-order indices (M_b,) and their values (M_b,)."""
        offsets = np.zeros(len(indices) + 1, np.int64)
        np.cumsum([len(index) for index in indices], out=offsets[1:])
        flat = np.concatenate([*indices, np.empty(0, np.int64)]).astype(np.int64)
        zyx = np.stack(np.unravel_index(flat, shape), axis=1).astype(np.int32)
        joined = np.concatenate([*values, np.empty(0, np.float32)]).astype(np.float32)
        return cls(np.ascontiguousarray(zyx), joined, offsets, shape)

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def dense(self) -> Tensor:
        """(B, D, H, W) tensor of the same grids."""
        out = torch.zeros((len(self), *self.shape), dtype=torch.from_numpy(self.values).dtype)
        for b in range(len(self)):
            rows = slice(self.offsets[b], self.offsets[b + 1])
            z, y, x = torch.from_numpy(self.zyx[rows].astype(np.int64)).T
            out[b, z, y, x] = torch.from_numpy(self.values[rows])
        return out


def convolve(occupancy: Occupancy, kernel: Tensor) -> Tensor:
    """Convolve each grid with ``kernel``; differentiable in the kernel.

    The observer is linear (thesis Eq. 4.1), so a weighted sum of kernels is convolved once.

    Args:
        occupancy: B grids of shape (D, H, W).
        kernel: (kz, ky, kx), float32 or float64, any size, odd or even.

    Returns:
        (B, D, H, W) of the kernel's dtype.
    """
    return _OccupancyConvolution.apply(kernel, occupancy)


class _OccupancyConvolution(torch.autograd.Function):
    @staticmethod
    def forward(ctx, kernel: Tensor, occupancy: Occupancy) -> Tensor:
        ctx.occupancy = occupancy
        ctx.kernel_size = tuple(kernel.shape)
        weights = np.ascontiguousarray(kernel.detach().numpy())
        out = np.zeros((len(occupancy), *occupancy.shape), weights.dtype)
        values = occupancy.values.astype(weights.dtype, copy=False)
        _scatter(occupancy.zyx, values, occupancy.offsets, weights, out)
        return torch.from_numpy(out)

    @staticmethod
    def backward(ctx, upstream: Tensor) -> tuple[Tensor, None]:
        occupancy = ctx.occupancy
        dense = np.ascontiguousarray(upstream.numpy())
        values = occupancy.values.astype(dense.dtype, copy=False)
        parts = np.zeros((len(occupancy), *ctx.kernel_size), dense.dtype)
        _gather(occupancy.zyx, values, occupancy.offsets, dense, parts)
        return torch.from_numpy(parts.sum(axis=0)), None


@numba.njit(parallel=True, cache=True)
def _scatter(zyx, values, offsets, kernel, out):  # pragma: no cover - compiled
    """out[b] += values * kernel around each occupied voxel; grids are shared out over threads."""
    kz, ky, kx = kernel.shape
    _, depth, height, width = out.shape
    az, ay, ax = (kz - 1) // 2, (ky - 1) // 2, (kx - 1) // 2
    for b in numba.prange(out.shape[0]):
        for i in range(offsets[b], offsets[b + 1]):
            # The output voxel p = voxel - q + a must lie in the grid, which bounds q on each axis.
            z, y, x = zyx[i, 0] + az, zyx[i, 1] + ay, zyx[i, 2] + ax
            value = values[i]
            for qz in range(max(0, z - depth + 1), min(kz, z + 1)):
                for qy in range(max(0, y - height + 1), min(ky, y + 1)):
                    for qx in range(max(0, x - width + 1), min(kx, x + 1)):
                        out[b, z - qz, y - qy, x - qx] += value * kernel[qz, qy, qx]


@numba.njit(parallel=True, cache=True)
def _gather(zyx, values, offsets, upstream, parts):  # pragma: no cover - compiled
    """parts[b] = gradient of sum(upstream[b] * out[b]) with respect to the kernel."""
    _, kz, ky, kx = parts.shape
    _, depth, height, width = upstream.shape
    az, ay, ax = (kz - 1) // 2, (ky - 1) // 2, (kx - 1) // 2
    for b in numba.prange(upstream.shape[0]):
        for i in range(offsets[b], offsets[b + 1]):
            z, y, x = zyx[i, 0] + az, zyx[i, 1] + ay, zyx[i, 2] + ax
            value = values[i]
            for qz in range(max(0, z - depth + 1), min(kz, z + 1)):
                for qy in range(max(0, y - height + 1), min(ky, y + 1)):
                    for qx in range(max(0, x - width + 1), min(kx, x + 1)):
                        parts[b, qz, qy, qx] += value * upstream[b, z - qz, y - qy, x - qx]
