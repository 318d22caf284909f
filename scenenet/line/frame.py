"""The frame of a span: along it, to its left, and up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SpanFrame:
    """A straight piece of a line in plan.

    Attributes:
        x, y: m, its start.
        direction: (2,) unit vector along it.
        length: m.
    """

    x: float
    y: float
    direction: np.ndarray
    length: float

    @classmethod
    def between(cls, first: np.ndarray, last: np.ndarray) -> SpanFrame:
        """From one place (2,) m to another."""
        step = np.asarray(last, float)[:2] - np.asarray(first, float)[:2]
        length = float(np.hypot(*step))
        return cls(float(first[0]), float(first[1]), step / length, length)

    def to_frame(self, xyz: np.ndarray) -> np.ndarray:
        """s along the span, t to its left, and z, (n, 3) m, of points (n, 3) m."""
        return np.column_stack((*self.in_plan(xyz), xyz[:, 2]))

    def in_plan(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """s along the span and t to its left, each (n,) m, of points (n, 2 or 3) m."""
        east, north = xyz[:, 0] - self.x, xyz[:, 1] - self.y
        dx, dy = self.direction
        return east * dx + north * dy, north * dx - east * dy

    def to_map(self, stz: np.ndarray) -> np.ndarray:
        """Points (n, 3) m of s, t and z (n, 3) m."""
        s, t, z = stz.T
        dx, dy = self.direction
        return np.column_stack((self.x + s * dx - t * dy, self.y + s * dy + t * dx, z))
