"""Candidate axes: positions where detected voxels are above one another."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np

from scenenet.core.progress import track_if
from scenenet.detection.detected_voxels import DetectedArea, DetectedSurvey, DetectedVoxels
from scenenet.detection.settings import DetectionSettings

SURROUNDINGS_M = 28.0
"""m, radius around an axis in which the survey is measured: conductors are looked for up to 20 m
along them, where they may pass the axis at up to 20 m."""

SAME_M = 0.5
"""m, axes closer to one another than this are the same."""

MEAN_SHIFTS = 5
"""Number of times that an axis moves to the mean of the voxels around it; the last moves are
small."""

BESIDE_M = 120.0
"""m beside an area in which axes are looked for too, because they decide on those in the area.
Where that is not far enough, more is looked at."""


class DistinctPlaces:
    """Positions in plan that are all further than ``SAME_M`` from one another.

    They are kept in cells: a survey of 100 km has 100 000 candidates, each of which is compared
    with those near it only.
    """

    def __init__(self) -> None:
        self._cells: defaultdict[tuple[int, int], list[tuple[float, float]]] = defaultdict(list)

    def add(self, x: float, y: float) -> bool:
        """Add a position in m; False, and nothing is added, where one of them is the same."""
        i, j = math.floor(x / SAME_M), math.floor(y / SAME_M)
        for a in (i - 1, i, i + 1):
            for b in (j - 1, j, j + 1):
                for other in self._cells.get((a, b), ()):
                    if math.hypot(x - other[0], y - other[1]) <= SAME_M:
                        return False
        self._cells[i, j].append((x, y))
        return True


def axes(
    detected: DetectedSurvey,
    settings: DetectionSettings,
    apart: float,
    progress: str | None = None,
) -> np.ndarray:
    """Positions (N, 2) m where detected voxels are above one another.

    Axes with more levels come first, and each axis starts at least ``apart`` m from all before it.
    It does not matter in which areas the voxels are given.

    Args:
        progress: label of the progress on stderr; None shows no progress.
    """
    found = [np.empty((0, 6))]
    for read in track_if(detected.areas(BESIDE_M), progress):
        area = read()
        own = _axes_of(area, settings, apart)
        while own is None and area.wider is not None:
            area = area.wider()
            own = _axes_of(area, settings, apart)
        if own is not None:
            found.append(own)
    ranked = np.concatenate(found)
    ranked = ranked[np.lexsort(ranked[:, 3::-1].T)]
    # The mean of neighbouring columns is often the same.
    places = DistinctPlaces()
    return ranked[[places.add(x, y) for x, y in ranked[:, 4:].tolist()], 4:]


def _axes_of(area: DetectedArea, settings: DetectionSettings, apart: float) -> np.ndarray | None:
    """Rank (N, 4) of the columns in the core of an area that have an axis, and the axis (N, 2) m;
    None if that depends on what is not seen.

    A column is left out where an axis of an earlier one is near it. Beside the area not all of that
    is known: a column is in doubt where such an axis may come from what is not seen, or from
    another column in doubt.
    """
    voxels, radius = area.voxels, settings.eps / 2
    ranks = voxels.ranks()
    inside, core = area.inside(voxels.columns), area.in_core(voxels.columns)
    # An axis moves by at most ``radius`` each time, and the rank depends on the neighbours.
    moved = MEAN_SHIFTS * radius
    unknown = inside < moved + radius + 2 * voxels.voxel_size
    doubtful = inside < 2 * moved + radius + apart + 2 * voxels.voxel_size
    if (unknown & core).any():
        return None
    taken = np.zeros(len(ranks), bool)
    found = []
    for column in np.lexsort(ranks[:, ::-1].T):
        if taken[column] or unknown[column]:
            continue
        body, axis = _mean_shift(voxels, voxels.columns[column], radius)
        near = voxels.columns_within(axis, apart)
        if doubtful[column]:
            if core[column]:
                return None
            doubtful[near] = True
            continue
        taken[near] = True
        taken[column] = True
        extent = np.ptp(voxels.z[body]) + voxels.voxel_size
        if core[column] and len(body) >= settings.min_voxels and extent >= settings.min_body:
            found.append((*ranks[column], *axis))
    return np.array(found).reshape(-1, 6)


def _mean_shift(
    detected: DetectedVoxels, axis: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """The voxels within a radius in m around an axis (2,) m that has moved to their mean, and the
    axis."""
    body = np.empty(0, np.int64)
    for _ in range(MEAN_SHIFTS):
        nearer = detected.within(axis, radius)
        if np.array_equal(nearer, body):
            break
        body, axis = nearer, detected.mean(nearer)
    return body, axis


def neighbours_adjacent(axes: np.ndarray) -> np.ndarray:
    """Axes (N, 2) m in an order that keeps neighbours adjacent, because they need the same
    surroundings."""
    x, y = axes.T
    return axes[np.lexsort((y, x, y // SURROUNDINGS_M, x // SURROUNDINGS_M))]
