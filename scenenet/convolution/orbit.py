"""The strongest response among the kernels of an orbit, such as the turns of a kernel about z.

A kernel with a direction is a few hundred kernels, and most of them are zero at most positions: a
line passes through 2 % of its box. The orbit is therefore stored by position: for each position the
kernels that are not zero there, with their values. An occupied voxel in reach of an output adds to
those kernels only. Most of the time is spent near the centre, where all kernels of an orbit meet
(docs/method/performance.md has the times).

Kernels that are not zero at more than ``DENSE`` of the positions are convolved one after the other
instead. The two ways differ in the order of their sums, so by rounding.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.convolve import convolution_gradient, convolve, convolve_at_voxels
from scenenet.convolution.occupancy import Occupancy, Shape
from scenenet.core.compilation import COMPILED

DENSE = 0.15
"""Share of positions that are not zero from which kernels are faster one after the other: an entry
stored by position costs about six times a position of a kernel."""


class Orbit(NamedTuple):
    """The kernels of an orbit, by position.

    Attributes:
        n: number of kernels.
        size: (kz, ky, kx).
        starts: (kz * ky * kx + 1,) int64: position q, in C order, has the entries
            ``starts[q] : starts[q + 1]``.
        which: (E,) int32, the kernel of an entry.
        value: (E,) its value, of the dtype of the kernels.
        kernels: (n, kz, ky, kx), where they are convolved one after the other; else None. There
            are no entries then.
    """

    n: int
    size: Shape
    starts: np.ndarray
    which: np.ndarray
    value: np.ndarray
    kernels: Tensor | None = None

    @classmethod
    def of(cls, kernels: Tensor, dense: float = DENSE) -> Orbit:
        """The orbit of kernels (n, kz, ky, kx), float32 or float64.

        Args:
            dense: share of positions that are not zero above which they are not stored by position.
        """
        n, kz, ky, kx = kernels.shape
        kernels = kernels.detach()
        if int(torch.count_nonzero(kernels)) > dense * kernels.numel():
            none = np.empty(0, np.int32), np.empty(0, kernels.numpy().dtype)
            return cls(n, (kz, ky, kx), np.zeros(1, np.int64), *none, kernels)
        by_position = np.ascontiguousarray(kernels.numpy().reshape(n, -1).T)
        position, which = np.nonzero(by_position)
        starts = np.searchsorted(position, np.arange(kz * ky * kx + 1))
        value = by_position[position, which]
        return cls(n, (kz, ky, kx), starts.astype(np.int64), which.astype(np.int32), value)


def strongest_at_voxels(
    occupancy: Occupancy, orbit: Orbit, at: np.ndarray | None = None
) -> np.ndarray:
    """The maximum over the orbit of the responses of ``convolve``, at some voxels; no gradient.

    Args:
        occupancy: B grids of shape (D, H, W).
        at: (M,) the voxels, ascending, as ``Occupancy.flat`` numbers them; None for the occupied
            ones.

    Returns:
        (M,) of the dtype of the orbit, in the order of ``at``.
    """
    if orbit.kernels is not None:
        best = convolve_at_voxels(occupancy, orbit.kernels[:1], at)[0]
        for kernel in orbit.kernels[1:]:
            torch.maximum(best, convolve_at_voxels(occupancy, kernel[None], at)[0], out=best)
        return best.numpy()
    flat = occupancy.flat()
    depth, height, width = occupancy.shape
    rows = np.searchsorted(flat, np.arange(len(occupancy) * depth * height + 1) * width)
    values = np.ones(1, orbit.value.dtype)
    if occupancy.values is not None:
        values = occupancy.values.astype(orbit.value.dtype, copy=False)
    wanted = flat if at is None else at
    out = np.empty(len(wanted), orbit.value.dtype)
    _strongest(
        flat,
        values,
        occupancy.values is not None,
        rows,
        np.array(occupancy.shape, np.int64),
        wanted,
        np.array(orbit.size, np.int64),
        orbit.n,
        orbit.starts,
        orbit.which,
        orbit.value,
        out,
    )
    return out


def strongest(occupancy: Occupancy, kernels: Tensor) -> Tensor:
    """The maximum over ``kernels`` of ``convolve`` everywhere; differentiable in the kernels.

    Args:
        occupancy: B grids of shape (D, H, W).
        kernels: (n, kz, ky, kx), float32 or float64.

    Returns:
        (B, D, H, W), of the dtype of the kernels.
    """
    return _Strongest.apply(kernels, occupancy)


class _Strongest(torch.autograd.Function):
    """Only the winner of each voxel is kept: the responses of an orbit fill gigabytes."""

    @staticmethod
    def forward(ctx, kernels: Tensor, occupancy: Occupancy) -> Tensor:
        best = convolve(occupancy, kernels[0].detach())
        winner = torch.zeros(best.shape, dtype=torch.int16)
        for n, kernel in enumerate(kernels[1:].detach(), start=1):
            response = convolve(occupancy, kernel)
            better = response > best
            best = torch.where(better, response, best)
            winner[better] = n
        ctx.occupancy, ctx.shape = occupancy, tuple(kernels.shape)
        ctx.save_for_backward(winner)
        return best

    @staticmethod
    def backward(ctx, upstream: Tensor) -> tuple[Tensor, None]:
        (winner,) = ctx.saved_tensors
        n, *size = ctx.shape
        gradient = torch.zeros(ctx.shape, dtype=upstream.dtype)
        for k in range(n):
            won = winner == k
            if won.any():
                gradient[k] = convolution_gradient(ctx.occupancy, upstream * won, tuple(size))
        return gradient, None


@numba.njit(parallel=True, **COMPILED)
def _strongest(
    flat, values, valued, rows, shape, wanted, size, n, starts, which, value, out
):  # pragma: no cover - compiled
    """out[i] = max over the orbit of the response at voxel wanted[i]."""
    depth, height, width = shape
    kz, ky, kx = size
    az, ay, ax = (kz - 1) // 2, (ky - 1) // 2, (kx - 1) // 2
    pieces = min(len(wanted), 256)
    for piece in numba.prange(pieces):
        sums = np.empty(n, value.dtype)
        for i in range(piece, len(wanted), pieces):
            sums[:] = 0
            x = wanted[i] % width
            row = wanted[i] // width
            y, plane = row % height, row // height
            z = plane % depth
            for qz in range(max(0, az - z), min(kz, depth + az - z)):
                for qy in range(max(0, ay - y), min(ky, height + ay - y)):
                    source = (plane + qz - az) * height + y + qy - ay
                    before = source * width + x - ax
                    end = rows[source + 1]
                    for j in range(_first(flat, rows[source], end, before), end):
                        qx = flat[j] - before
                        if qx >= kx:
                            break
                        q = (qz * ky + qy) * kx + qx
                        factor = values[j] if valued else values[0]
                        for e in range(starts[q], starts[q + 1]):
                            sums[which[e]] += factor * value[e]
            out[i] = sums.max()


@numba.njit(**COMPILED)
def _first(flat, low, high, value):  # pragma: no cover - compiled
    """The first of the ascending ``flat[low:high]`` that is no less than ``value``, or ``high``."""
    while low < high:
        middle = (low + high) // 2
        if flat[middle] < value:
            low = middle + 1
        else:
            high = middle
    return low
