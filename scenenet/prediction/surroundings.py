"""The occupied voxels and the points of a survey, looked up by place."""

from __future__ import annotations

from collections import OrderedDict, defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
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
"""Tiles of points kept in memory: those around a tower. A tile of a dense survey takes 15 MB."""

KEPT_IN_ALL = 1_000_000
"""Positions kept in memory, in more tiles where they are small: 12 MB. On a slope, more tiles than
``KEPT_POINTS`` are around a tower."""


@dataclass(frozen=True)
class Positions:
    """The positions in a tile, in half of the memory of coordinates: each is
    ``(steps + shift) * size + corner``.

    Attributes:
        steps: (3, n) int32 or float32, of x, y and z, each of which is faster to read alone.
        shift: in steps.
        size: m, of a step.
        corner: (3,) m.
    """

    steps: np.ndarray
    shift: float
    size: float
    corner: np.ndarray

    @classmethod
    def of_voxels(cls, spool: TileSpool, code: int) -> Positions:
        """The centres of the occupied voxels, as ``TileSpool.centres`` gives them."""
        steps = spool.tile(code).zyx().T[::-1].astype(np.int32)
        return cls(steps, 0.5, spool.voxel_size, np.zeros(3))

    @classmethod
    def of_points(cls, spool: TileSpool, code: int) -> Positions:
        """The points, as ``TileSpool.points`` gives them."""
        steps = np.ascontiguousarray(spool.offsets(code).T)
        return cls(steps, 0.0, 1.0, spool.lattice.corner(code))

    def __len__(self) -> int:
        return self.steps.shape[1]

    def around(self, place: np.ndarray, radius: float) -> np.ndarray:
        """(3, m) m, those within a planar radius of a place (2,), in their order."""
        return _around(self.steps, self.shift, self.size, self.corner, *place.tolist(), radius)


@numba.njit(nogil=True, **EXACT)
def _around(steps, shift, size, corner, east, north, radius):  # pragma: no cover - compiled
    """(3, m) m, the positions (n,) within a planar radius of a place, in their order."""
    rows, n = np.empty(steps.shape[1], np.int64), 0
    for i in range(steps.shape[1]):
        rows[n] = i
        x = (steps[0, i] + shift) * size + corner[0]
        y = (steps[1, i] + shift) * size + corner[1]
        n += within(x - east, y - north, radius)
    found = np.empty((3, n))
    for axis in range(3):
        for k in range(n):
            found[axis, k] = (steps[axis, rows[k]] + shift) * size + corner[axis]
    return found


class SurveySurroundings:
    """What is near a place; each tile is read when a look-up needs it. Threads may share it."""

    def __init__(self, spool: TileSpool, read: Callable[[int], Positions], kept: int) -> None:
        """Start with no tile in memory.

        Args:
            read: gives the positions in the tile with a code.
            kept: number of tiles in memory; more are kept up to ``KEPT_IN_ALL`` positions.
        """
        self._edge = EDGE * spool.voxel_size
        self._above: dict[tuple[int, int], list[int]] = defaultdict(list)
        for code, (_, y, x) in spool.places():
            self._above[x, y].append(code)
        self._read, self._kept = read, kept
        self._tiles: OrderedDict[int, Positions] = OrderedDict()
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

    def _tile(self, code: int) -> Positions:
        """The positions in a tile. Those that were used last stay in memory."""
        with self._lock:
            if code not in self._tiles:
                self._tiles[code] = self._read(code)
                self._in_memory += len(self._tiles[code])
                while len(self._tiles) > self._kept and self._in_memory > KEPT_IN_ALL:
                    self._in_memory -= len(self._tiles.popitem(last=False)[1])
            self._tiles.move_to_end(code)
            return self._tiles[code]


def occupied_voxels(spool: TileSpool) -> SurveySurroundings:
    """The centres of the occupied voxels."""
    return SurveySurroundings(spool, partial(Positions.of_voxels, spool), KEPT_TILES)


def survey_points(spool: TileSpool) -> SurveySurroundings:
    """The points."""
    return SurveySurroundings(spool, partial(Positions.of_points, spool), KEPT_POINTS)
