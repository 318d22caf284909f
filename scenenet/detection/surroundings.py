"""What is around a position: points of a survey, or its occupied voxels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Surroundings = Callable[[np.ndarray, float], np.ndarray]
"""A function of a position (2,) m and a radius in m, which returns the points, or the centres of
the occupied voxels, within this radius in plan, (M, 3) m."""


def surroundings_in(places: np.ndarray) -> Surroundings:
    """The surroundings among places (M, 3) m in memory."""

    def near(place: np.ndarray, radius: float) -> np.ndarray:
        return places[np.hypot(places[:, 0] - place[0], places[:, 1] - place[1]) <= radius]

    return near
