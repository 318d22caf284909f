"""Detected voxels, with search by position in plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numba
import numpy as np

from scenenet.core.compilation import EXACT

ROUNDING_M = 1e-6
"""More than a position in plan is rounded by."""

Box = tuple[float, float, float, float]
"""(x, y, x, y) m, lowest and highest, relative to the offset of the detected voxels."""

EVERYWHERE: Box = (-np.inf, -np.inf, np.inf, np.inf)


class DetectedVoxels:
    """Detected voxels (V, 3) m, with search by position in plan.

    What follows from the column of a voxel is not kept for each: there are millions.

    Attributes:
        offset: (3,) m; all positions here are relative to it.
        voxel_size: m.
        z: (V,) m, of their centres.
        probability: (V,).
        columns: (C, 2) m, the positions in plan that have one, by x, then y.
    """

    def __init__(
        self,
        centres: np.ndarray,
        probability: np.ndarray,
        voxel_size: float,
        offset: np.ndarray | None = None,
    ) -> None:
        """Sort the voxels by column.

        Args:
            centres: (V, 3) m.
            probability: (V,).
            voxel_size: m.
            offset: (3,) m; None for the lowest x, y and z.
        """
        self.probability, self.voxel_size = probability, voxel_size
        if offset is None:
            offset = centres.min(axis=0) if len(centres) else np.zeros(3)
        self.offset = offset
        self.z = centres[:, 2] - self.offset[2]
        x, of_x = _ranked(centres[:, 0] - self.offset[0])
        y, of_y = _ranked(centres[:, 1] - self.offset[1])
        column = of_x * len(y) + of_y
        del of_x, of_y
        self._by_column = np.argsort(column, kind="stable").astype(np.int32)
        numbers, count = np.unique(column, return_counts=True)
        self._starts = np.append(0, np.cumsum(count))
        self._column = np.searchsorted(numbers, column).astype(np.int32)
        row = numbers // max(len(y), 1)
        self.columns = np.column_stack([x[row], y[numbers % max(len(y), 1)]])
        # The columns of each x, which are next to one another.
        self._x, self._rows = x, np.searchsorted(row, np.arange(len(x) + 1))

    def __len__(self) -> int:
        return len(self.z)

    def areas(self, beside: float) -> Sequence[Callable[[], DetectedArea]]:
        """All of them, as one area (``DetectedSurvey``)."""
        whole = DetectedArea(self, EVERYWHERE, EVERYWHERE)
        return [lambda: whole] if len(self) else []

    def around(self, place: np.ndarray, radius: float) -> DetectedVoxels:
        """All of them (``DetectedSurvey``)."""
        return self

    def columns_within(self, place: np.ndarray, radius: float) -> np.ndarray:
        """Columns (C,) within a planar radius in m of a position (2,) m, ascending."""
        return _columns_within(self._x, self._rows, self.columns, place[0], place[1], radius)

    def within(self, place: np.ndarray, radius: float) -> np.ndarray:
        """Voxels within a planar radius in m of a position (2,) m, column by column."""
        return _members(self._by_column, self._starts, self.columns_within(place, radius))

    def mean(self, voxels: np.ndarray) -> np.ndarray:
        """(2,) m, mean position of voxels, weighted by their probabilities."""
        weight = self.probability[voxels].astype(float)
        places = self.columns[self._column[voxels]]
        return np.asarray((places * weight[:, None]).sum(axis=0) / weight.sum())

    def ranks(self) -> np.ndarray:
        """(C, 4), what the columns are sorted by, lowest first: number of detected levels and sum
        of probabilities, neighbouring columns included, both negative; x and y."""
        level = np.rint(self.z / self.voxel_size).astype(np.int32)
        levels, total = _levels_and_sums(
            self._x, self._rows, self.columns, 1.5 * self.voxel_size,
            self._by_column, self._starts, level, self.probability,
        )  # fmt: skip
        return np.column_stack([-levels, -total, self.columns])


@dataclass(frozen=True)
class DetectedArea:
    """The detected voxels in an area of a survey, and those around it.

    Attributes:
        voxels: the voxels.
        core: the area, with its west and south borders.
        seen: where all detected voxels are among ``voxels``; ``core`` lies in it.
        wider: gives the same area with more around it; None where nothing else is around.
    """

    voxels: DetectedVoxels
    core: Box
    seen: Box
    wider: Callable[[], DetectedArea] | None = None

    def in_core(self, places: np.ndarray) -> np.ndarray:
        """(n,) bool, which places (n, 2) m lie in the core."""
        west, south, east, north = self.core
        x, y = places.T
        return np.asarray((x >= west) & (x < east) & (y >= south) & (y < north))

    def inside(self, places: np.ndarray) -> np.ndarray:
        """(n,) m, distance of places (n, 2) m from what is not seen; negative outside."""
        west, south, east, north = self.seen
        x, y = places.T
        return np.minimum(np.minimum(x - west, east - x), np.minimum(y - south, north - y))


class DetectedSurvey(Protocol):
    """The detected voxels of a survey, given area by area: a long one has too many for memory."""

    @property
    def offset(self) -> np.ndarray:
        """(3,) m, the lowest x, y and z of all; the voxels of each area are relative to it."""

    @property
    def voxel_size(self) -> float:
        """m."""

    def areas(self, beside: float) -> Sequence[Callable[[], DetectedArea]]:
        """Areas whose cores have every detected voxel once, each with what lies up to ``beside`` m
        beside it. They are read when they are called."""

    def around(self, place: np.ndarray, radius: float) -> DetectedVoxels:
        """Voxels among which are all within a planar radius in m of a position (2,) m."""


def _ranked(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The distinct ones of values (n,), ascending, and the rank (n,) of each: as
    ``np.unique(..., return_inverse=True)``, which takes twice the memory."""
    distinct = np.unique(values)
    return distinct, np.searchsorted(distinct, values)


@numba.njit(**EXACT)
def _columns_within(x, rows, columns, east, north, radius):  # pragma: no cover - compiled
    """Columns (c,) within a planar radius in m of a place, ascending.

    Args:
        x: (X,) m, distinct x of all columns.
        rows: (X + 1,) number of the first column with each.
        columns: (C, 2) m.
    """
    squared, reach = radius * radius, radius + ROUNDING_M
    low = np.searchsorted(x, east - reach)
    high = np.searchsorted(x, east + reach)
    n = 0
    for i in range(low, high):
        n += rows[i + 1] - rows[i]
    found, n = np.empty(n, np.int64), 0
    for i in range(low, high):
        dx = x[i] - east
        first, last = rows[i], rows[i + 1]
        first += np.searchsorted(columns[first:last, 1], north - reach)
        for column in range(first, last):
            dy = columns[column, 1] - north
            if dy > reach:
                break
            if dx * dx + dy * dy <= squared:
                found[n] = column
                n += 1
    return found[:n]


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
def _levels_and_sums(
    x, rows, columns, reach, by_column, starts, level, probability
):  # pragma: no cover - compiled
    """Number of distinct levels (C,), and sum of the probabilities (C,), of the voxels in the
    columns within ``reach`` m of each column."""
    levels, total = np.empty(len(columns)), np.empty(len(columns))
    for column in range(len(columns)):
        east, north = columns[column]
        near = _members(by_column, starts, _columns_within(x, rows, columns, east, north, reach))
        levels[column] = _n_distinct(level[near])
        total[column] = _sum(probability[near])
    return levels, total


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


@numba.njit(**EXACT)
def _sum(values):  # pragma: no cover - compiled
    """Sum of values (n,), added in the order in which ``np.sum`` adds them."""
    n = len(values)
    if n > 128:
        half = n // 2
        half -= half % 8
        return _sum(values[:half]) + _sum(values[half:])
    total = np.zeros_like(values[:1])
    if n < 8:
        for value in values:
            total[0] += value
        return total[0]
    part, whole = values[:8].copy(), n - n % 8
    for i in range(8, whole, 8):
        for k in range(8):
            part[k] += values[i + k]
    total[0] = ((part[0] + part[1]) + (part[2] + part[3])) + (
        (part[4] + part[5]) + (part[6] + part[7])
    )
    for i in range(whole, n):
        total[0] += values[i]
    return total[0]
