"""Probability, error and counts from the observer, plane by plane while the plane is in the cache
(thesis 4.3, 4.5).

The response of the observer, H(x), passes through tanh and ReLU. The result is a probability for
every voxel, an error against the labels, or counts at every threshold. Only the probabilities need
a volume. The other two only keep a few numbers, and the gradient of the error with respect to the
kernel is accumulated from each plane before the next one replaces it. In rows that no occupied
voxel reaches every value is (tanh(bias))_+, so the row counts at once.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.compiled.activation import activate
from scenenet.convolution.compiled.kernel_tables import kernel_of, table_of
from scenenet.convolution.compiled.options import TASKS, first_plane
from scenenet.convolution.compiled.planes import gather_plane, layout, sum_plane
from scenenet.convolution.compiled.volumes import activate_row, fill_volume
from scenenet.convolution.convolve import convolution_gradient, table_shape
from scenenet.convolution.occupancy import Occupancy
from scenenet.core.compilation import COMPILED


def observe(occupancy: Occupancy, kernel: Tensor, bias: Tensor | None = None) -> Tensor:
    """(tanh(x * kernel + bias))_+: the probability of each voxel; differentiable.

    Args:
        occupancy: B grids of shape (D, H, W).
        kernel: (kz, ky, kx), float32 or float64.
        bias: (), zero if None.

    Returns:
        (B, D, H, W) of the kernel's dtype, in [0, 1].
    """
    bias = kernel.new_zeros(()) if bias is None else bias
    return _Observation.apply(kernel, bias, occupancy)


def squared_error(
    occupancy: Occupancy,
    kernel: Tensor,
    bias: Tensor | None,
    tower: np.ndarray,
    weights: tuple[float, float],
) -> Tensor:
    """sum over all voxels of f_w(y) (M(x) - y)^2 (thesis Eq. 4.4); differentiable.

    Args:
        occupancy, kernel, bias: as ``observe`` takes them.
        tower: (T,) int64, ascending flat positions in (B, D, H, W) of the voxels with y = 1.
        weights: f_w(0) and f_w(1).

    Returns:
        () of the kernel's dtype.
    """
    bias = kernel.new_zeros(()) if bias is None else bias
    # Decided here, because torch disables gradients inside forward().
    needs_gradient = torch.is_grad_enabled() and (kernel.requires_grad or bias.requires_grad)
    return _SquaredError.apply(kernel, bias, occupancy, tower, weights, needs_gradient)


def count_reached(
    occupancy: Occupancy,
    kernel: Tensor,
    bias: Tensor | None,
    tower: np.ndarray,
    thresholds: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of voxels by how many thresholds they reach, without a volume.

    Args:
        occupancy, kernel, bias, tower: as ``squared_error`` takes them; no gradient.
        thresholds: (S,) ascending, all above zero; compared in the kernel's dtype.

    Returns:
        two arrays (S + 1,) int64: the numbers of tower voxels and of other voxels that reach
        exactly i of the thresholds.
    """
    bias = kernel.new_zeros(()) if bias is None else bias
    weights = _numpy(kernel)
    taus = thresholds.astype(weights.dtype)
    counts = np.zeros((TASKS, 2, len(taus) + 1), np.int64)
    span = float(np.arctanh(min(float(taus[-1]), 1 - 1e-9)))
    _count(
        occupancy.runs,
        table_of(weights),
        weights.shape[2],
        _scalar(bias),
        tower,
        occupancy.plane_rows(tower),
        taus,
        len(taus) / span,
        counts,
    )
    other, true = counts.sum(axis=0)
    return true, other


class _Observation(torch.autograd.Function):
    @staticmethod
    def forward(ctx, kernel: Tensor, bias: Tensor, occupancy: Occupancy) -> Tensor:
        weights = _numpy(kernel)
        out = np.empty((len(occupancy), *occupancy.shape), weights.dtype)
        table = table_of(weights)
        fill_volume(occupancy.runs, table, weights.shape[2], _scalar(bias), True, out)
        probability = torch.from_numpy(out)
        ctx.occupancy, ctx.size = occupancy, tuple(kernel.shape)
        ctx.save_for_backward(probability)
        return probability

    @staticmethod
    def backward(ctx, upstream: Tensor) -> tuple[Tensor, Tensor, None]:
        (probability,) = ctx.saved_tensors
        through = upstream * (1 - probability.square()) * (probability > 0)
        return convolution_gradient(ctx.occupancy, through, ctx.size), through.sum(), None


class _SquaredError(torch.autograd.Function):
    """The gradient is accumulated in the forward pass, because the planes are not kept."""

    @staticmethod
    def forward(
        ctx,
        kernel: Tensor,
        bias: Tensor,
        occupancy: Occupancy,
        tower: np.ndarray,
        weights: tuple[float, float],
        needs_gradient: bool,
    ) -> Tensor:
        array = _numpy(kernel)
        size = array.shape
        shape = table_shape(size) if needs_gradient else (0, 0, 0, 0)
        tables = np.zeros((TASKS, *shape), array.dtype)
        sums = np.zeros((TASKS, 2))
        _score(
            occupancy.runs,
            table_of(array),
            size[2],
            _scalar(bias),
            tower,
            occupancy.plane_rows(tower),
            np.array(weights, array.dtype),
            needs_gradient,
            tables,
            sums,
        )
        error, by_bias = sums.sum(axis=0)
        if needs_gradient:
            by_kernel = torch.from_numpy(kernel_of(tables, size[2]))
            ctx.save_for_backward(by_kernel, torch.tensor(by_bias, dtype=bias.dtype))
        return torch.tensor(error, dtype=kernel.dtype)

    @staticmethod
    def backward(ctx, upstream: Tensor) -> tuple[Tensor | None, ...]:
        by_kernel, by_bias = ctx.saved_tensors
        return upstream * by_kernel, upstream * by_bias, None, None, None, None


@numba.njit(parallel=True, **COMPILED)
def _score(
    runs, table, kx, bias, tower, starts, weights, needs_gradient, tables, sums
):  # pragma: no cover - compiled
    """sums[task] += error and its derivative by the bias; tables[task] += that by the table."""
    _, height, width = runs.shape
    n_rows, length, above, left = layout(table, kx, height, width)
    two = table.dtype.type(2)
    one = table.dtype.type(1)
    empty, at_tower = weights[0], weights[1]
    beyond = activate(bias)
    slope_beyond = two * empty * beyond * (one - beyond * beyond)
    for task in numba.prange(TASKS):
        buffer = np.empty(n_rows * length, table.dtype)
        slope = np.zeros(n_rows * length, table.dtype)
        reached = np.empty(height, np.bool_)
        error, by_bias = 0.0, 0.0
        for p in range(first_plane(task), len(runs.planes) - 1, TASKS):
            occupied = sum_plane(p, runs, table, buffer, length, reached)
            for y in range(height):
                begin = (y + above) * length + left
                row, slopes = buffer[begin : begin + width], slope[begin : begin + width]
                if reached[y]:
                    _activate_in_place(row, bias)
                    _slope_row(row, two * empty, slopes)
                    error += empty * _sum_of_squares(row)
                    by_bias += _sum(slopes)
                else:
                    row[:] = beyond
                    slopes[:] = slope_beyond
                    error += width * np.float64(empty * beyond * beyond)
                    by_bias += width * np.float64(slope_beyond)
            for i in range(starts[p], starts[p + 1]):
                within = tower[i] - np.int64(p) * height * width
                y = within // width
                at = (y + above) * length + left + within - y * width
                found = buffer[at]
                missing = one - found
                error += at_tower * missing * missing - empty * found * found
                # The ReLU has no slope where the response is not positive, however large the error.
                steep = -two * at_tower * missing * (one - found * found) if found > 0 else found
                by_bias += steep - slope[at]
                slope[at] = steep
            if needs_gradient and occupied:
                gather_plane(p, runs, slope, length, tables[task])
        sums[task, 0], sums[task, 1] = error, by_bias


@numba.njit(parallel=True, **COMPILED)
def _count(
    runs, table, kx, bias, tower, starts, thresholds, density, counts
):  # pragma: no cover - compiled
    """counts[task, tower or not, thresholds reached] += voxels, for each plane of the batch."""
    _, height, width = runs.shape
    n_rows, length, above, left = layout(table, kx, height, width)
    beyond = _reached(activate(bias), bias, thresholds, density)
    for task in numba.prange(TASKS):
        buffer = np.empty(n_rows * length, table.dtype)
        reached = np.empty(height, np.bool_)
        row = np.empty(width, table.dtype)
        steps = np.empty((height, width), np.int32)
        for p in range(first_plane(task), len(runs.planes) - 1, TASKS):
            sum_plane(p, runs, table, buffer, length, reached)
            for y in range(height):
                if not reached[y]:
                    steps[y] = beyond
                    counts[task, 0, beyond] += width
                    continue
                responses = buffer[(y + above) * length + left :]
                activate_row(responses, bias, row)
                for x in range(width):
                    step = _reached(row[x], responses[x] + bias, thresholds, density)
                    steps[y, x] = step
                    counts[task, 0, step] += 1
            for i in range(starts[p], starts[p + 1]):
                within = tower[i] - np.int64(p) * height * width
                step = steps[within // width, within % width]
                counts[task, 1, step] += 1
                counts[task, 0, step] -= 1


@numba.njit(**COMPILED)
def _reached(probability, response, thresholds, density):  # pragma: no cover - compiled
    """How many thresholds a probability reaches; NaN reaches none.

    There are about ``density`` thresholds per unit of the response before tanh, which gives a first
    estimate; comparisons with the probability then correct it.
    """
    if not probability >= thresholds[0]:
        return 0
    step = min(len(thresholds), max(1, int(min(response, 1e6) * density)))
    while step < len(thresholds) and probability >= thresholds[step]:
        step += 1
    while probability < thresholds[step - 1]:
        step -= 1
    return step


@numba.njit(**COMPILED)
def _activate_in_place(row, bias):  # pragma: no cover - compiled
    for x in range(len(row)):
        row[x] = activate(row[x] + bias)


@numba.njit(**COMPILED)
def _slope_row(probabilities, factor, out):  # pragma: no cover - compiled
    """out = derivative of factor / 2 p^2 with respect to the response; 0 where p is 0 (ReLU)."""
    one = probabilities.dtype.type(1)
    for x in range(len(out)):
        p = probabilities[x]
        out[x] = factor * p * (one - p * p)


REDUCED = COMPILED | {"fastmath": {"contract", "reassoc"}}
"""The compiler may sum a row lane by lane; the order it chooses is always the same."""


@numba.njit(**REDUCED)
def _sum_of_squares(row):  # pragma: no cover - compiled
    total = row.dtype.type(0)
    for x in range(len(row)):
        total += row[x] * row[x]
    return np.float64(total)


@numba.njit(**REDUCED)
def _sum(row):  # pragma: no cover - compiled
    total = row.dtype.type(0)
    for x in range(len(row)):
        total += row[x]
    return np.float64(total)


def _numpy(tensor: Tensor) -> np.ndarray:
    return np.ascontiguousarray(tensor.detach().numpy())


def _scalar(tensor: Tensor) -> Any:
    return tensor.detach().numpy()[()]
