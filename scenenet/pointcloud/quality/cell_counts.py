"""Counts of points per cell and of duplicates, in bounded memory."""

from __future__ import annotations

import numpy as np

MIX = (np.uint64(0x9E3779B97F4A7C15), np.uint64(0xC2B2AE3D27D4EB4F), np.uint64(0x165667B19E3779F9))
"""Odd constants of common 64-bit hash functions."""
BIAS = 2**30
"""Cells are numbered from -BIAS to BIAS along each axis, so that two numbers fit in 64 bits."""


class CellCounts:
    """Points per cell of a grid; if there are too many cells, their side doubles.

    Attributes:
        cell: current side of a cell, in the unit of the coordinates.
    """

    def __init__(self, cell: float, max_cells: int) -> None:
        self.cell = cell
        self._max_cells = max_cells
        self._cells = np.empty(0, np.int64)
        self._counts = np.empty(0, np.int64)

    @property
    def n_cells(self) -> int:
        return len(self._cells)

    def add(self, u: np.ndarray, v: np.ndarray | None = None) -> None:
        """Count points by their coordinates (n,) along one axis or two."""
        along_v = BIAS if v is None else self._number(v)
        cells, counts = np.unique((self._number(u) << 32) | along_v, return_counts=True)
        self._merge(np.concatenate([self._cells, cells]), np.concatenate([self._counts, counts]))
        while len(self._cells) > self._max_cells:
            self.cell *= 2
            u_cell, v_cell = ((self.axis(axis) // 2) + BIAS for axis in (0, 1))
            self._merge((u_cell << 32) | v_cell, self._counts)

    def axis(self, axis: int) -> np.ndarray:
        """(n_cells,) number of each cell along an axis (0 or 1)."""
        return (self._cells >> 32 if axis == 0 else self._cells & 0xFFFFFFFF) - BIAS

    def _number(self, coordinates: np.ndarray) -> np.ndarray:
        # Of a stray coordinate such as 1e300 it only matters that it is far away.
        cells = np.clip(np.floor(coordinates / self.cell), -BIAS, BIAS)
        return cells.astype(np.int64) + BIAS

    def _merge(self, cells: np.ndarray, counts: np.ndarray) -> None:
        self._cells, inverse = np.unique(cells, return_inverse=True)
        self._counts = np.bincount(inverse, weights=counts).astype(np.int64)

    def count_far(self, axis: int, factor: float) -> int:
        """Points that are outside the middle 98 % along ``axis`` by more than ``factor``
        extents."""
        if not self.n_cells:
            return 0
        values, inverse = np.unique(self.axis(axis), return_inverse=True)
        counts = np.bincount(inverse, weights=self._counts)
        share = np.cumsum(counts) / counts.sum()
        low, high = values[np.searchsorted(share, [0.01, 0.99])]
        reach = factor * (high - low + 1)
        return int(counts[(values < low - reach) | (values > high + reach)].sum())


class DuplicateCount:
    """Points with the same coordinates as an earlier one.

    Places are stored as 64-bit hashes. If there are too many, only those with a hash below a limit
    are kept, and the limit halves. A place is either always or never kept, so the sample has all
    duplicates of its places.
    """

    def __init__(self, max_places: int) -> None:
        self._max_places = max_places
        self._hashes = np.empty(0, np.uint64)
        self._waiting: list[np.ndarray] = []
        self._n_waiting = 0
        self._extra = np.empty(0, np.int64)
        self._bits = 0

    @property
    def is_sampled(self) -> bool:
        """Whether only a sample of the places is kept."""
        self._settle()
        return self._bits > 0

    def add(self, places: np.ndarray) -> None:
        """Count (n, 3) uint64 places: the bits of the coordinates."""
        hashes = np.zeros(len(places), np.uint64)
        for axis in range(3):
            hashes = (hashes ^ places[:, axis]) * MIX[axis]
            hashes ^= hashes >> np.uint64(29)
        hashes = hashes[self._keeps(hashes)]
        self._waiting.append(hashes)
        self._n_waiting += len(hashes)
        if self._n_waiting > self._max_places:  # sorting rarely is cheaper than sorting each time
            self._settle()

    def _keeps(self, hashes: np.ndarray) -> np.ndarray:
        if self._bits == 0:
            return np.ones(len(hashes), bool)
        return hashes >> np.uint64(64 - self._bits) == 0

    def _settle(self) -> None:
        """Merge the waiting hashes into the stored ones, and drop hashes until they fit."""
        if not self._waiting:
            return
        known = len(self._hashes)
        hashes = np.concatenate([self._hashes, *self._waiting])
        weights = np.ones(len(hashes))
        weights[:known] += self._extra
        self._waiting, self._n_waiting = [], 0
        self._hashes, inverse = np.unique(hashes, return_inverse=True)
        self._extra = np.bincount(inverse, weights=weights).astype(np.int64) - 1
        while len(self._hashes) > self._max_places:
            self._bits += 1
            keep = self._keeps(self._hashes)
            self._hashes, self._extra = self._hashes[keep], self._extra[keep]

    def estimate(self, n_points: int) -> int:
        """Number of points with the same coordinates as an earlier one; exact unless
        ``is_sampled``."""
        self._settle()
        extra = int(self._extra.sum())
        if self._bits == 0:
            return extra
        seen = extra + len(self._hashes)
        return round(extra / seen * n_points) if seen else 0
