"""The strongest response among the kernels of an orbit, such as the turns of a kernel about z.

A kernel with a direction is a few hundred kernels, and most of them are zero at most positions: a
line passes through 2 % of its box. The orbit is therefore stored by position: for each position the
kernels that are not zero there, in rows of ``LANES`` neighbours, with their values. An occupied
voxel in reach of an output adds to those kernels only. Most of the time is spent near the centre,
where all kernels of an orbit meet (docs/method/performance.md has the times).

Kernels that are not zero at more than ``DENSE`` of the positions are convolved one after the other
instead. The two ways differ in the order of their sums, so by rounding.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.compiled.rows import LANES, add_row
from scenenet.convolution.convolve import convolution_gradient, convolve, convolve_at_voxels
from scenenet.convolution.occupancy import Occupancy, Shape
from scenenet.core.compilation import COMPILED

DENSE = 0.15
"""Share of positions that are not zero from which kernels are convolved one after the other."""


class Orbit(NamedTuple):
    """The kernels of an orbit, by position.

    Attributes:
        n: number of kernels that differ.
        size: (kz, ky, kx).
        starts: (kz * ky * kx + 1,) int64: position q, in C order, has the rows
            ``starts[q] : starts[q + 1]``.
        first: (R,) int32, the first kernel of a row. Kernels that are neighbours in the orbit are
            neighbours in direction, so few rows have all that are not zero at a position.
        value: (R, LANES) values of the kernels of a row, of the dtype of the kernels.
        lines: (kz * ky, 2) int64, first position along x at which a kernel is not zero, and the
            one after the last; equal where all are zero.
        kernels: (n, kz, ky, kx), where they are convolved one after the other; else None. There
            are no rows then.
    """

    n: int
    size: Shape
    starts: np.ndarray
    first: np.ndarray
    value: np.ndarray
    lines: np.ndarray
    kernels: Tensor | None = None

    @classmethod
    def of(cls, kernels: Tensor, dense: float = DENSE) -> Orbit:
        """The orbit of kernels (n, kz, ky, kx), float32 or float64.

        Args:
            dense: share of positions that are not zero above which they are not stored by position.
        """
        kernels = _differing(kernels.detach())
        n, kz, ky, kx = kernels.shape
        if int(torch.count_nonzero(kernels)) > dense * kernels.numel():
            value = np.empty((0, LANES), kernels.numpy().dtype)
            none = np.zeros(1, np.int64), np.empty(0, np.int32), value, np.empty((0, 2), np.int64)
            return cls(n, (kz, ky, kx), *none, kernels)
        by_position = np.zeros((kz * ky * kx, n + LANES), kernels.numpy().dtype)
        by_position[:, :n] = kernels.numpy().reshape(n, -1).T
        position, which = np.nonzero(by_position)
        starts, first = _rows(position, which, len(by_position))
        at = np.repeat(np.arange(len(by_position)), np.diff(starts))
        value = by_position[at[:, None], first[:, None] + np.arange(LANES)]
        seen = (np.diff(starts) > 0).reshape(kz * ky, kx)
        lines = np.stack([seen.argmax(axis=1), kx - seen[:, ::-1].argmax(axis=1)], axis=1)
        lines[~seen.any(axis=1)] = 0
        return cls(n, (kz, ky, kx), starts, first, value, lines)


def _differing(kernels: Tensor) -> Tensor:
    """The kernels of an orbit without the second half turn, if it repeats the first one."""
    half, rest = divmod(len(kernels), 2)
    repeats = half > 0 and not rest and torch.equal(kernels[:half], kernels[half:])
    return kernels[:half] if repeats else kernels


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
        orbit.first,
        orbit.value.reshape(-1),
        orbit.lines,
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


@numba.njit(**COMPILED)
def _rows(position, which, n_positions):  # pragma: no cover - compiled
    """``starts`` and ``first`` of an orbit from the ascending position and kernel of each value
    (E,) that is not zero."""
    starts = np.zeros(n_positions + 1, np.int64)
    first = np.empty(len(position), np.int32)
    n, at, end = 0, -1, 0
    for e in range(len(position)):
        if position[e] != at or which[e] >= end:
            at, end = position[e], which[e] + LANES
            first[n] = which[e]
            n += 1
            starts[at + 1] += 1
    for q in range(n_positions):
        starts[q + 1] += starts[q]
    return starts, first[:n].copy()


AT_ONCE = 64
"""Voxels that a core takes at once: enough to look up the surroundings of a row of a grid once."""


@numba.njit(parallel=True, **COMPILED)
def _strongest(
    flat, values, valued, rows, shape, wanted, size, n, starts, first, value, lines, out
):  # pragma: no cover - compiled
    """out[i] = max over the orbit of the response at voxel wanted[i]."""
    width, kx = shape[2], size[2]
    ax = (kx - 1) // 2
    for piece in numba.prange((len(wanted) + AT_ONCE - 1) // AT_ONCE):
        sums = np.empty(n + LANES, value.dtype)
        near = np.empty((len(lines), 4), np.int64)
        n_near, of = 0, np.int64(-1)
        for i in range(piece * AT_ONCE, min((piece + 1) * AT_ONCE, len(wanted))):
            row = wanted[i] // width
            x = wanted[i] - row * width - ax
            if row != of:
                of, n_near = row, _lines_near(row, x, flat, rows, shape, size, lines, near)
            sums[:] = 0
            for k in range(n_near):
                j, end, line, begin = near[k]
                before = begin + x
                low, high = before + lines[line, 0], before + lines[line, 1]
                # The voxels of a row ascend, so what one has passed is behind the next one too.
                while j < end and flat[j] < low:
                    j += 1
                near[k, 0] = j
                while j < end and flat[j] < high:
                    q = line * kx + flat[j] - before
                    factor = values[j] if valued else values[0]
                    for e in range(starts[q], starts[q + 1]):
                        add_row(sums, first[e], value, e * LANES, factor)  # type: ignore[call-arg]
                    j += 1
            out[i] = sums[:n].max()


@numba.njit(**COMPILED)
def _lines_near(row, x, flat, rows, shape, size, lines, near):  # pragma: no cover - compiled
    """Write the rows of occupied voxels that a kernel at row ``row`` of the grids reaches into
    ``near`` (L, 4), and return their number.

    Each has its first voxel that matters, its end, the line of the kernel that lies on it, and the
    position of its first place. ``x`` is the first column that the kernel reaches.
    """
    depth, height, width = shape
    kz, ky, _ = size
    az, ay = (kz - 1) // 2, (ky - 1) // 2
    y, plane = row % height, row // height
    z = plane % depth
    n = 0
    for qz in range(max(0, az - z), min(kz, depth + az - z)):
        above = (plane + qz - az) * height
        if rows[above] == rows[above + height]:
            continue
        for qy in range(max(0, ay - y), min(ky, height + ay - y)):
            source, line = above + y + qy - ay, qz * ky + qy
            begin, end = rows[source], rows[source + 1]
            if begin < end and lines[line, 0] < lines[line, 1]:
                low = source * width + x + lines[line, 0]
                # By number: numba compiles a check of shapes into the assignment of a row.
                near[n, 0], near[n, 1] = _first(flat, begin, end, low), end
                near[n, 2], near[n, 3] = line, source * width
                n += 1
    return n


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
