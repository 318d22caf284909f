"""Gaussian means of a raster at some of its cells."""

from __future__ import annotations

import numba
import numpy as np

from scenenet.core.compilation import EXACT

CUT = 4.0
"""Widths from its middle at which a Gaussian is cut off."""


def gaussian_at(values: np.ndarray, width: float, at: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """The Gaussian means (n,) of a raster at some cells, with 0 beyond its border.

    They are those of ``scipy.ndimage.gaussian_filter`` with ``mode="constant"``, to the bit. That
    takes all cells of the raster, and a ground model needs those of its gaps only.

    Args:
        values: (rows, columns) float64.
        width: cells, standard deviation.
        at: row and column (n,) of each cell.
    """
    steps = np.arange(int(CUT * width + 0.5) + 1)
    share = np.exp(-0.5 / (width * width) * np.concatenate((-steps[:0:-1], steps)) ** 2)
    weights = (share / share.sum())[-len(steps) :]
    return _along_rows(_along_columns(values, weights), weights, *at)


@numba.njit(**EXACT)
def _along_columns(values, weights):  # pragma: no cover - compiled
    """The means within each column; the weights are those of 0, 1, ... cells to either side."""
    n_rows, n_columns = values.shape
    means = np.empty_like(values)
    for row in range(n_rows):
        mean = means[row]
        for column in range(n_columns):
            mean[column] = values[row, column] * weights[0]
        # From afar to near, as scipy adds them up.
        for step in range(len(weights) - 1, 0, -1):
            weight, below, above = weights[step], row - step, row + step
            if below >= 0 and above < n_rows:
                for column in range(n_columns):
                    mean[column] += (values[below, column] + values[above, column]) * weight
            elif below >= 0 or above < n_rows:
                one = below if below >= 0 else above
                for column in range(n_columns):
                    mean[column] += values[one, column] * weight
    return means


@numba.njit(**EXACT)
def _along_rows(values, weights, rows, columns):  # pragma: no cover - compiled
    """The means within a row, at the cells in ``rows`` and ``columns`` (n,)."""
    means = np.empty(len(rows))
    for i in range(len(rows)):
        own, column = values[rows[i]], columns[i]
        mean = own[column] * weights[0]
        for step in range(len(weights) - 1, 0, -1):
            before, after = column - step, column + step
            if before >= 0 and after < len(own):
                mean += (own[before] + own[after]) * weights[step]
            elif before >= 0 or after < len(own):
                mean += own[before if before >= 0 else after] * weights[step]
        means[i] = mean
    return means
