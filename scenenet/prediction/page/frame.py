"""The part of the plane that the map of a survey shows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MapFrame:
    """The part of the plane that a map shows.

    SVG has y downwards and single precision, so its coordinates count from the north-west corner.

    Attributes:
        west, north: x and y of the corner, in the units of the survey.
        width, height: in the same units.
    """

    west: float
    north: float
    width: float
    height: float

    @classmethod
    def around(cls, boxes: Iterable[Sequence[float]]) -> MapFrame:
        """The smallest frame in whole units around boxes (x, y, x, y), of which some may be NaN."""
        corners = np.array([box for box in boxes if np.isfinite(box).all()]).reshape(-1, 4)
        if not len(corners):
            return cls(0.0, 1.0, 1.0, 1.0)
        west, south = np.floor(corners[:, :2].min(axis=0)).tolist()
        east, north = np.ceil(corners[:, 2:].max(axis=0)).tolist()
        return cls(west, north, max(east - west, 1.0), max(north - south, 1.0))

    def place(self, x: float, y: float) -> str:
        """A place as text, in the coordinates of the map."""
        return f"{x - self.west:.2f} {self.north - y:.2f}"

    def ring(self, xy: np.ndarray) -> str:
        """A closed ring (n, 2) as path data."""
        return "M" + "L".join(self.place(*corner) for corner in xy[:-1].tolist()) + "Z"
