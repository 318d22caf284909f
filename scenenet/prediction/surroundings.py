"""The occupied voxels and the points of a survey, looked up by place."""

from __future__ import annotations

from collections import OrderedDict, defaultdict
from collections.abc import Callable

import numpy as np

from scenenet.prediction.tiling import EDGE, TileSpool

KEPT_TILES = 64
"""Tiles of voxels kept in memory: successive look-ups mostly need the same ones."""

KEPT_POINTS = 9
"""Tiles of points kept in memory: those around a tower. A tile of a dense survey takes 30 MB."""

KEPT_IN_ALL = 2_000_000
"""Positions kept in memory, in more tiles where they are small: 48 MB. On a slope, more tiles than
``KEPT_POINTS`` are around a tower."""


class SurveySurroundings:
    """What is near a place; each tile is read when a look-up needs it."""

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
        self._tiles: OrderedDict[int, np.ndarray] = OrderedDict()

    def __call__(self, place: np.ndarray, radius: float) -> np.ndarray:
        """(M, 3) m, the positions within a planar radius in m of a place (2,)."""
        low, high = (np.floor((place + r) / self._edge).astype(int) for r in (-radius, radius))
        near = [np.empty((0, 3))]
        for x in range(low[0], high[0] + 1):
            for y in range(low[1], high[1] + 1):
                for code in self._above.get((x, y), ()):
                    positions = self._positions(code)
                    # Most of a tile is further away on one axis, which a comparison shows.
                    rows = np.flatnonzero(np.abs(positions[:, 0] - place[0]) <= radius)
                    rows = rows[np.abs(positions[rows, 1] - place[1]) <= radius]
                    apart = np.hypot(*(positions[rows, :2] - place).T)
                    near.append(positions[rows[apart <= radius]])
        return np.concatenate(near)

    def _positions(self, code: int) -> np.ndarray:
        """(n, 3) m, the positions in a tile. Those that were used last stay in memory."""
        if code not in self._tiles:
            self._tiles[code] = self._read(code)
            while (
                len(self._tiles) > self._kept
                and sum(len(tile) for tile in self._tiles.values()) > KEPT_IN_ALL
            ):
                self._tiles.popitem(last=False)
        self._tiles.move_to_end(code)
        return self._tiles[code]


def occupied_voxels(spool: TileSpool) -> SurveySurroundings:
    """The centres of the occupied voxels."""
    return SurveySurroundings(spool, lambda code: spool.centres(spool.tile(code).zyx()), KEPT_TILES)


def survey_points(spool: TileSpool) -> SurveySurroundings:
    """The points."""
    return SurveySurroundings(spool, spool.points, KEPT_POINTS)
