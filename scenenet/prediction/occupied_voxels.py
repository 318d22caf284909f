"""The occupied voxels of a survey, looked up by place."""

from __future__ import annotations

from collections import defaultdict
from functools import lru_cache

import numpy as np

from scenenet.prediction.tiling import EDGE, TileSpool

KEPT_TILES = 64
"""Tiles kept in memory: successive look-ups mostly need the same ones."""


class OccupiedVoxels:
    """The occupied voxels of a survey; each tile is read when a look-up needs it."""

    def __init__(self, spool: TileSpool) -> None:
        self._spool = spool
        self._edge = EDGE * spool.voxel_size
        self._above: dict[tuple[int, int], list[int]] = defaultdict(list)
        for code, (_, y, x) in spool.places():
            self._above[x, y].append(code)
        self._centres = lru_cache(maxsize=KEPT_TILES)(self._read)

    def __call__(self, place: np.ndarray, radius: float) -> np.ndarray:
        """(M, 3) m, centres of the occupied voxels within a planar radius in m of a place (2,)."""
        low, high = (np.floor((place + r) / self._edge).astype(int) for r in (-radius, radius))
        near = [np.empty((0, 3))]
        for x in range(low[0], high[0] + 1):
            for y in range(low[1], high[1] + 1):
                for code in self._above.get((x, y), ()):
                    centres = self._centres(code)
                    apart = np.hypot(centres[:, 0] - place[0], centres[:, 1] - place[1])
                    near.append(centres[apart <= radius])
        return np.concatenate(near)

    def _read(self, code: int) -> np.ndarray:
        return self._spool.centres(self._spool.tile(code).zyx())
