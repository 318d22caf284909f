"""The detected voxels of a survey, read from its predictions area by area."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from math import ceil

import numpy as np

from scenenet.detection.detected_voxels import Box, DetectedArea, DetectedVoxels
from scenenet.prediction.work.lattice import EDGE, column_of
from scenenet.prediction.work.tile_predictions import TilePredictions
from scenenet.prediction.work.tiling import TileSpool

AREA_TILES = 16
"""Tiles of voxels along the edge of an area."""

BESIDE_TILES = 2
"""Tiles around the area in which a place is looked up."""

KEPT_AREAS = 4
"""Areas in memory: a square of this size lies in four."""


class SurveyDetections:
    """The detected voxels of a survey (``scenenet.detection.detected_voxels.DetectedSurvey``).

    Attributes:
        offset: (3,) m, the lowest x, y and z of their centres.
        voxel_size: m.
    """

    def __init__(self, spool: TileSpool, predictions: TilePredictions, threshold: float) -> None:
        """Look where they are.

        Args:
            predictions: for all tiles of ``spool``.
            threshold: probability from which a voxel is detected.
        """
        self._spool, self._predictions, self._threshold = spool, predictions, threshold
        self.voxel_size = spool.voxel_size
        self._columns: defaultdict[tuple[int, int], list[int]] = defaultdict(list)
        lowest: list[np.ndarray] = []
        for code, _ in spool.places():
            zyx, _, _ = predictions.detected(threshold, [code])
            if len(zyx):
                self._columns[column_of(code)].append(code)
                lowest.append(zyx.min(axis=0))
        self.offset = np.zeros(3)
        if lowest:
            self.offset = spool.centres(np.min(lowest, axis=0)[None])[0]
        self._kept = lru_cache(maxsize=KEPT_AREAS)(self._voxels)

    def areas(self, beside: float) -> Sequence[Callable[[], DetectedArea]]:
        """Squares of tiles."""
        numbers = sorted({(x // AREA_TILES, y // AREA_TILES) for x, y in self._columns})
        tiles = ceil(beside / (EDGE * self.voxel_size))
        return [partial(self._area, x, y, tiles) for x, y in numbers]

    def around(self, place: np.ndarray, radius: float) -> DetectedVoxels:
        """Voxels among which are all within a planar radius in m of a position (2,) m."""
        tile = EDGE * self.voxel_size
        x, y = np.floor((place + self.offset[:2]) / (AREA_TILES * tile)).astype(int).tolist()
        return self._kept(x, y, max(BESIDE_TILES, ceil(radius / tile)))

    def shares(self, place: np.ndarray, radius: float) -> np.ndarray:
        """(n, K) of the voxels within a planar radius in m of a position (2,) m relative to the
        offset."""
        low, high = (place + self.offset[:2] + r for r in (-radius, radius))
        columns = self._spool.lattice.columns((low[0], high[0]), (low[1], high[1]))
        codes = [code for column in columns for code in self._columns.get(column, ())]
        zyx, probability, shares = self._predictions.detected(self._threshold, codes)
        near = self._sorted(zyx, probability).within(place, radius)
        return np.asarray(shares[near])

    def _area(self, x: int, y: int, beside: int) -> DetectedArea:
        """The area with a number, and ``beside`` tiles around it."""
        wider = partial(self._area, x, y, 2 * beside)
        core, seen = self._box(x, y, 0), self._box(x, y, beside)
        return DetectedArea(self._kept(x, y, beside), core, seen, wider)

    def _voxels(self, x: int, y: int, beside: int) -> DetectedVoxels:
        """The voxels in the area with a number, and in ``beside`` tiles around it."""
        west, south, east, north = _tiles(x, y, beside)
        codes = [
            code
            for column in ((i, j) for i in range(west, east) for j in range(south, north))
            for code in self._columns.get(column, ())
        ]
        zyx, probability, _ = self._predictions.detected(self._threshold, codes)
        return self._sorted(zyx, probability)

    def _sorted(self, zyx: np.ndarray, probability: np.ndarray) -> DetectedVoxels:
        centres = self._spool.centres(zyx)
        return DetectedVoxels(centres, probability, self.voxel_size, self.offset)

    def _box(self, x: int, y: int, beside: int) -> Box:
        corners = np.array(_tiles(x, y, beside)) * (EDGE * self.voxel_size)
        west, south, east, north = (corners - np.tile(self.offset[:2], 2)).tolist()
        return west, south, east, north


def _tiles(x: int, y: int, beside: int) -> tuple[int, int, int, int]:
    """Columns of tiles (west, south, east, north) of the area with a number, and of ``beside``
    tiles around it."""
    west, south = x * AREA_TILES, y * AREA_TILES
    return (
        west - beside, south - beside, west + AREA_TILES + beside, south + AREA_TILES + beside
    )  # fmt: skip
