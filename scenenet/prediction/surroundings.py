"""The occupied voxels and the points of a survey, looked up by place."""

from __future__ import annotations

from collections import OrderedDict, defaultdict
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scenenet.prediction.work.tiling import EDGE, TileSpool

KEPT_TILES = 64
"""Tiles of voxels kept in memory: successive look-ups mostly need the same ones."""

KEPT_POINTS = 9
"""Tiles of points kept in memory: those around a tower. A tile of a dense survey takes 30 MB."""

KEPT_IN_ALL = 2_000_000
"""Positions kept in memory, in more tiles where they are small: 80 MB. On a slope, more tiles than
``KEPT_POINTS`` are around a tower."""

ROUNDING_M = 1e-3
"""More than a distance in metres is rounded by."""


@dataclass(frozen=True)
class _Positions:
    """The positions in a tile.

    Attributes:
        xyz: (n, 3) m.
        x, y: (n,) m, copies of two columns, which are much faster to read alone.
    """

    xyz: np.ndarray
    x: np.ndarray
    y: np.ndarray

    @classmethod
    def of(cls, xyz: np.ndarray) -> _Positions:
        return cls(xyz, xyz[:, 0].copy(), xyz[:, 1].copy())

    def around(self, place: np.ndarray, radius: float) -> np.ndarray:
        """(m, 3) m, those within a planar radius of a place (2,), in the order of ``xyz``."""
        east, north = self.x - place[0], self.y - place[1]
        squared = east * east + north * north
        inside = squared <= max(radius - ROUNDING_M, 0.0) ** 2
        # Squares are rounded, so the distance itself decides at the border.
        border = np.flatnonzero(~inside & (squared <= (radius + ROUNDING_M) ** 2))
        inside[border] = np.hypot(east[border], north[border]) <= radius
        return self.xyz[inside]


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
        self._tiles: OrderedDict[int, _Positions] = OrderedDict()

    def __call__(self, place: np.ndarray, radius: float) -> np.ndarray:
        """(M, 3) m, the positions within a planar radius in m of a place (2,)."""
        low, high = (np.floor((place + r) / self._edge).astype(int) for r in (-radius, radius))
        near = [np.empty((0, 3))]
        for x in range(low[0], high[0] + 1):
            for y in range(low[1], high[1] + 1):
                for code in self._above.get((x, y), ()):
                    near.append(self._tile(code).around(place, radius))
        return np.concatenate(near)

    def _tile(self, code: int) -> _Positions:
        """The positions in a tile. Those that were used last stay in memory."""
        if code not in self._tiles:
            self._tiles[code] = _Positions.of(self._read(code))
            while (
                len(self._tiles) > self._kept
                and sum(len(tile.xyz) for tile in self._tiles.values()) > KEPT_IN_ALL
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
