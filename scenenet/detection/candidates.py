"""Candidate axes: positions where detected voxels are above one another."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator

import numba
import numpy as np

from scenenet.core.compilation import EXACT
from scenenet.core.progress import track_if
from scenenet.detection.settings import DetectionSettings

SURROUNDINGS_M = 28.0
"""m, radius around an axis in which the survey is measured: conductors are looked for up to 20 m
along them, where they may pass the axis at up to 20 m."""

SAME_M = 0.5
"""m, axes closer to one another than this are the same."""

MEAN_SHIFTS = 5
"""Number of times that an axis moves to the mean of the voxels around it; the last moves are
small."""


PROBED = 50_000
"""Columns whose neighbours are looked up at once; the lists of all would take too much memory."""


class DetectedVoxels:
    """Detected voxels (V, 3) m, with search by position in plan.

    A long survey has millions, so what follows from the column of a voxel is not kept for each.

    Attributes:
        offset: (3,) m, the lowest x, y and z; all positions here are relative to it.
        voxel_size: m.
        z: (V,) m, of their centres.
        probability: (V,).
        columns: (C, 2) m, the positions in plan that have one, by x, then y.
    """

    def __init__(self, centres: np.ndarray, probability: np.ndarray, voxel_size: float) -> None:
        """Sort the voxels by column.

        Args:
            centres: (V, 3) m.
            probability: (V,).
            voxel_size: m.
        """
        from scipy.spatial import cKDTree

        self.probability, self.voxel_size = probability, voxel_size
        self.offset = centres.min(axis=0) if len(centres) else np.zeros(3)
        self.z = centres[:, 2] - self.offset[2]
        x, of_x = _ranked(centres[:, 0] - self.offset[0])
        y, of_y = _ranked(centres[:, 1] - self.offset[1])
        column = of_x * len(y) + of_y
        del of_x, of_y
        self._by_column = np.argsort(column, kind="stable").astype(np.int32)
        numbers, count = np.unique(column, return_counts=True)
        self._starts = np.append(0, np.cumsum(count))
        self._column = np.searchsorted(numbers, column).astype(np.int32)
        self.columns = np.column_stack([x[numbers // max(len(y), 1)], y[numbers % max(len(y), 1)]])
        self._tree = cKDTree(self.columns)

    def __len__(self) -> int:
        return len(self.z)

    def columns_within(self, place: np.ndarray, radius: float) -> np.ndarray:
        """Columns (C,) within a planar radius in m of a position (2,) m, ascending."""
        columns = np.array(self._tree.query_ball_point(place, radius), np.int64)
        columns.sort()
        return columns

    def within(self, place: np.ndarray, radius: float) -> np.ndarray:
        """Voxels within a planar radius in m of a position (2,) m."""
        return self._in_columns(self.columns_within(place, radius))

    def _in_columns(self, columns: np.ndarray) -> np.ndarray:
        """Voxels in these columns, which ascend, column by column."""
        return _members(self._by_column, self._starts, columns)

    def mean(self, voxels: np.ndarray) -> np.ndarray:
        """(2,) m, mean position of voxels, weighted by their probabilities."""
        weight = self.probability[voxels].astype(float)
        places = self.columns[self._column[voxels]]
        return np.asarray((places * weight[:, None]).sum(axis=0) / weight.sum())

    def tallest_first(self) -> np.ndarray:
        """Columns by their number of detected levels, neighbouring columns included, highest
        first."""
        level = np.rint(self.z / self.voxel_size).astype(np.int32)
        reach = 1.5 * self.voxel_size
        levels, total = np.empty(len(self.columns)), np.empty(len(self.columns))
        for first in range(0, len(self.columns), PROBED):
            probed = self.columns[first : first + PROBED]
            adjacent = self._tree.query_ball_point(probed, reach, return_sorted=True)
            for column, neighbours in enumerate(adjacent, first):
                near = self._in_columns(np.array(neighbours, np.int64))
                levels[column] = _n_distinct(level[near])
                total[column] = self.probability[near].sum()
        return np.lexsort((self.columns[:, 1], self.columns[:, 0], -total, -levels))


@numba.njit(**EXACT)
def _members(by_column, starts, columns):  # pragma: no cover - compiled
    """Voxels of columns (C,), one after another."""
    n = 0
    for column in columns:
        n += starts[column + 1] - starts[column]
    members = np.empty(n, np.int64)
    n = 0
    for column in columns:
        for i in range(starts[column], starts[column + 1]):
            members[n] = by_column[i]
            n += 1
    return members


@numba.njit(**EXACT)
def _n_distinct(values):  # pragma: no cover - compiled
    """Number of distinct values (n,), which are few: they are sorted by insertion, in place."""
    n = 0
    for value in values:
        at = n
        while at > 0 and values[at - 1] > value:
            at -= 1
        if at == 0 or values[at - 1] != value:
            for i in range(n, at, -1):
                values[i] = values[i - 1]
            values[at] = value
            n += 1
    return n


def _ranked(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The distinct ones of values (n,), ascending, and the rank (n,) of each: as
    ``np.unique(..., return_inverse=True)``, which takes twice the memory."""
    distinct = np.unique(values)
    return distinct, np.searchsorted(distinct, values)


class DistinctPlaces:
    """Positions in plan that are all further than ``SAME_M`` from one another.

    They are kept in cells: a survey of 100 km has 100 000 candidates, each of which is compared
    with those near it only.
    """

    def __init__(self) -> None:
        self._cells: defaultdict[tuple[int, int], list[tuple[float, float]]] = defaultdict(list)

    def add(self, x: float, y: float) -> bool:
        """Add a position in m; False, and nothing is added, where one of them is the same."""
        i, j = math.floor(x / SAME_M), math.floor(y / SAME_M)
        for a in (i - 1, i, i + 1):
            for b in (j - 1, j, j + 1):
                for other in self._cells.get((a, b), ()):
                    if math.hypot(x - other[0], y - other[1]) <= SAME_M:
                        return False
        self._cells[i, j].append((x, y))
        return True


def axes(
    detected: DetectedVoxels,
    settings: DetectionSettings,
    apart: float,
    progress: str | None = None,
) -> Iterator[np.ndarray]:
    """Positions (2,) m where detected voxels are above one another.

    Axes with more levels come first, and each axis starts at least ``apart`` m from all before it.

    Args:
        progress: label of the progress on stderr; None shows no progress.
    """
    found = DistinctPlaces()
    taken = np.zeros(len(detected.columns), bool)
    for column in track_if(detected.tallest_first(), progress):
        if taken[column]:
            continue
        body, axis = _mean_shift(detected, detected.columns[column], settings.eps / 2)
        taken[detected.columns_within(axis, apart)] = True
        taken[column] = True
        extent = np.ptp(detected.z[body]) + detected.voxel_size
        if len(body) < settings.min_voxels or extent < settings.min_body:
            continue
        # The mean of neighbouring columns is often the same.
        if found.add(*axis.tolist()):
            yield axis


def _mean_shift(
    detected: DetectedVoxels, axis: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """The voxels within a radius in m around an axis (2,) m that has moved to their mean, and the
    axis."""
    body = np.empty(0, np.int64)
    for _ in range(MEAN_SHIFTS):
        nearer = detected.within(axis, radius)
        if np.array_equal(nearer, body):
            break
        body, axis = nearer, detected.mean(nearer)
    return body, axis


def neighbours_adjacent(axes: Iterable[np.ndarray]) -> list[np.ndarray]:
    """Axes in an order that keeps neighbours adjacent, because they need the same surroundings."""
    return sorted(axes, key=lambda axis: (*(axis // SURROUNDINGS_M), *axis))
