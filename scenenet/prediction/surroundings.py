"""The occupied voxels and the points of a survey, looked up by place."""

from __future__ import annotations

from collections import OrderedDict, defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

import numba
import numpy as np

from scenenet.core.compilation import EXACT
from scenenet.detection.within import within
from scenenet.prediction.work.lattice import EDGE
from scenenet.prediction.work.tiling import TileSpool

KEPT_TILES = 64
"""Tiles of voxels kept in memory: successive look-ups mostly need the same ones."""

KEPT_POINTS = 9
"""Tiles of points kept in memory: those around a tower. A tile of a dense survey takes 30 MB."""

KEPT_IN_ALL = 1_000_000
"""Positions kept in memory, in more tiles where they are small: 24 MB. On a slope, more tiles than
``KEPT_POINTS`` are around a tower."""


@dataclass(frozen=True)
class _Positions:
    """The positions in a tile.

    Attributes:
        columns: (3, n) m: x, y and z, each of which is faster to read alone.
    """

    columns: np.ndarray

    @classmethod
    def of(cls, xyz: np.ndarray) -> _Positions:
        return cls(np.ascontiguousarray(xyz.T))

    def __len__(self) -> int:
        return self.columns.shape[1]

    def around(self, place: np.ndarray, radius: float) -> np.ndarray:
        """(3, m) m, those within a planar radius of a place (2,), in their order."""
        x, y, z = self.columns
        return _around(x, y, z, *place.tolist(), radius)


@numba.njit(nogil=True, **EXACT)
def _around(x, y, z, east, north, radius):  # pragma: no cover - compiled
    """(3, m) m, the positions (n,) within a planar radius of a place, in their order."""
    rows, n = np.empty(len(x), np.int64), 0
    for i in range(len(x)):
        rows[n] = i
        n += within(x[i] - east, y[i] - north, radius)
    found = np.empty((3, n))
    for k in range(n):
        i = rows[k]
        found[0, k], found[1, k], found[2, k] = x[i], y[i], z[i]
    return found


class SurveySurroundings:
    """What is near a place; each tile is read when a look-up needs it. Threads may share it."""

    def __init__(self, spool: TileSpool, read: Callable[[int], np.ndarray], kept: int) -> None:
        """Start with no tile in memory.

        Args:
            read: gives the positions (n, 3) m in the tile with a code.
            kept: number of tiles in memory; more are kept up to ``KEPT_IN_ALL`` positions.
        """
        self._edge = EDGE * spool.voxel_size
        self._above: dict[tuple[int, int], list[int]] = defaultdict(list)
        for code, (_, y, x) in spool.places():
            self._above[x, y].append(code)
        self._read, self._kept = read, kept
        self._tiles: OrderedDict[int, _Positions] = OrderedDict()
        self._in_memory = 0
        self._lock = Lock()

    def __call__(self, place: np.ndarray, radius: float) -> np.ndarray:
        """(M, 3) m, the positions within a planar radius in m of a place (2,). Each of the three
        columns is contiguous."""
        low, high = (np.floor((place + r) / self._edge).astype(int) for r in (-radius, radius))
        near = [np.empty((3, 0))]
        for x in range(low[0], high[0] + 1):
            for y in range(low[1], high[1] + 1):
                for code in self._above.get((x, y), ()):
                    near.append(self._tile(code).around(place, radius))
        return np.concatenate(near, axis=1).T

    def _tile(self, code: int) -> _Positions:
        """The positions in a tile. Those that were used last stay in memory."""
        with self._lock:
            if code not in self._tiles:
                self._tiles[code] = _Positions.of(self._read(code))
                self._in_memory += len(self._tiles[code])
                while len(self._tiles) > self._kept and self._in_memory > KEPT_IN_ALL:
                    self._in_memory -= len(self._tiles.popitem(last=False)[1])
            self._tiles.move_to_end(code)
            return self._tiles[code]


def occupied_voxels(spool: TileSpool) -> SurveySurroundings:
    """The centres of the occupied voxels."""
    return SurveySurroundings(spool, lambda code: spool.centres(spool.tile(code).zyx()), KEPT_TILES)


def survey_points(spool: TileSpool) -> SurveySurroundings:
    """The points."""
    return SurveySurroundings(spool, spool.points, KEPT_POINTS)
