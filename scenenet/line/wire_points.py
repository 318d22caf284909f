"""The points of wires in a survey, looked up by place."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from scenenet.line.frame import SpanFrame

CELL_M = 4.0
"""m, edge of the cells in which points are looked up."""


@dataclass(frozen=True)
class WirePoints:
    """Points that may be on wires.

    Attributes:
        xyz: (N, 3) m.
        certain: (N,) bool, whether the observer takes the point for a wire; others are used only
            beside wires that are certain.
    """

    xyz: np.ndarray
    certain: np.ndarray

    def __len__(self) -> int:
        return len(self.xyz)

    @cached_property
    def answers(self) -> dict[bytes, Any]:
        """What was found among some of these points, by a digest of the question."""
        return {}

    @cached_property
    def _cells(self) -> tuple[np.ndarray, list[np.ndarray], Any]:
        """Centres (C, 2) of the occupied cells, the rows of the points in each, and their tree."""
        from scipy.spatial import cKDTree

        steps = np.floor(self.xyz[:, :2] / CELL_M).astype(np.int64)
        cells, of = np.unique(steps, axis=0, return_inverse=True)
        order = np.argsort(of.ravel(), kind="stable")
        rows = np.split(order, np.flatnonzero(np.diff(of.ravel()[order])) + 1)
        centres = (cells + 0.5) * CELL_M
        return centres, rows, cKDTree(centres)

    def beside(self, frame: SpanFrame, reach: float, beyond: float = 0.0) -> np.ndarray:
        """Rows of the points within ``reach`` m of the axis of a frame, ascending.

        Args:
            beyond: m, how far beyond its ends.
        """
        centres, rows, _ = self._cells
        if len(self) == 0:
            return np.empty(0, np.int64)
        s, t = frame.to_frame(np.column_stack((centres, np.zeros(len(centres)))))[:, :2].T
        near = (np.abs(t) <= reach + CELL_M) & (s >= -beyond - CELL_M)
        near &= s <= frame.length + beyond + CELL_M
        found = np.sort(
            np.concatenate([np.empty(0, int), *(rows[c] for c in np.flatnonzero(near))])
        )
        s, t = frame.to_frame(self.xyz[found])[:, :2].T
        inside = (np.abs(t) <= reach) & (s >= -beyond) & (s <= frame.length + beyond)
        return found[inside]

    def followed(self, frame: SpanFrame, reach: float) -> float:
        """Share of the axis of a frame that has a point within ``reach`` m of it."""
        _, _, tree = self._cells
        steps = np.arange(CELL_M, frame.length - CELL_M / 2, CELL_M)
        if len(self) == 0 or len(steps) == 0:
            return 0.0
        axis = np.array([frame.x, frame.y]) + steps[:, None] * frame.direction
        distance, _ = tree.query(axis, distance_upper_bound=reach)
        return float(np.mean(np.isfinite(distance)))
