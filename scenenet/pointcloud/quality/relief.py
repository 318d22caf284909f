"""Heights and distances that cannot be metres: heights in centimetres, or points far apart."""

from __future__ import annotations

import numpy as np

CELL = 20.0
"""Side of the cells, in the unit of the coordinates."""
HIGHEST = 250.0
"""Hardly any tower or cliff rises this high, m, within a cell; in centimetres it is 2.5 m."""
HIGH_SHARE = 0.01
"""Share of cells that are higher: more than a few stray points can cause."""
SPARSE = 0.1
"""Points per m2 below which no tower can be seen."""
MIN_POINTS = 1000
MAX_CELLS = 1_000_000
FAR = 2**30
"""Cells are numbered from -FAR to FAR along each axis, so that two numbers fit in 64 bits."""


def cell_numbers(xyz: np.ndarray, size: float) -> np.ndarray:
    """(n,) int64, the number of the planar cell of ``size`` that each of points (n, 3) lies in."""
    x, y = np.clip(np.floor(xyz[:, :2].T / size), -FAR, FAR).astype(np.int64) + FAR
    return np.asarray((x << 32) | y)


class Relief:
    """Lowest and highest point of each cell of a survey, from a sample of its points."""

    def __init__(self) -> None:
        self._cells = np.empty(0, np.int64)
        self._low, self._high = np.empty(0), np.empty(0)

    def add(self, xyz: np.ndarray) -> None:
        """Look at points (n, 3)."""
        if len(self._cells) > MAX_CELLS:
            return
        cells = np.concatenate([self._cells, cell_numbers(xyz, CELL)])
        low, high = (np.concatenate([old, xyz[:, 2]]) for old in (self._low, self._high))
        order = np.argsort(cells, kind="stable")
        self._cells, first = np.unique(cells[order], return_index=True)
        self._low = np.minimum.reduceat(low[order], first)
        self._high = np.maximum.reduceat(high[order], first)

    def findings(self, n_points: int) -> list[tuple[str, str]]:
        """(kind, text) of what cannot be metres, in a survey of ``n_points``."""
        if n_points < MIN_POINTS:
            return []
        found = []
        high = int(np.count_nonzero(self._high - self._low > HIGHEST))
        if high > HIGH_SHARE * len(self._cells):
            found.append(
                (
                    "heights",
                    f"z does not look like metres: it differs by more than {HIGHEST:g} within "
                    f"{CELL:g} m in {high} of {len(self._cells)} places. Convert the heights to "
                    "metres if they are in centimetres or feet, or remove stray points",
                )
            )
        density = n_points / (len(self._cells) * CELL**2)
        if density < SPARSE:
            found.append(
                (
                    "sparse",
                    f"there are only {density:.2g} points per m2, too few to see a tower. Convert "
                    "x and y to metres if they are in another unit",
                )
            )
        return found
