"""The structures of towers that people added, measured at their places."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from scenenet.detection.conductor_rules import FAR, FURTHEST_M
from scenenet.detection.detected_voxels import DetectedVoxels
from scenenet.detection.find import find_towers
from scenenet.detection.measured_tower import MeasuredTower
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.surroundings import surroundings_in
from scenenet.metrics.tower_matching import HIT_DISTANCE_M
from scenenet.review.labels.points import Points

AROUND_M = FURTHEST_M + FAR
"""m around a place of which the detection needs points."""

VOXEL_M = 0.5
"""m, edge of the voxels in which a body is looked for, where that of the prediction is unknown."""

STRICT = DetectionSettings(min_conductor=0)
LENIENT = DetectionSettings(min_conductor=0, min_height=3.0, min_body=1.5, min_upright=0.5)
"""Rules for a body at a place where a person saw a tower: those for any tower without conductors,
and, where these find none, for a low one or one with gaps."""


def points_around(places: np.ndarray, chunks: Iterable[Points]) -> list[np.ndarray]:
    """The points (n, 3) m within ``AROUND_M`` in plan of each place (P, 2) m."""
    kept: list[list[np.ndarray]] = [[np.empty((0, 3))] for _ in places]
    for chunk in chunks:
        for place, parts in zip(places, kept, strict=True):
            offset = chunk.xyz[:, :2] - place
            near = (np.abs(offset) <= AROUND_M).all(axis=1)
            near[near] = np.hypot(*offset[near].T) <= AROUND_M
            parts.append(chunk.xyz[near])
    return [np.concatenate(parts) for parts in kept]


def measure_at(
    place: np.ndarray, points: np.ndarray, voxel_size: float = VOXEL_M
) -> MeasuredTower | None:
    """The tower at a place (2,) m, measured as every tower is; None where no body stands there.

    The voxels near the place take the part of those that a model detects.

    Args:
        points: (n, 3) m, those around it.
        voxel_size: m.
    """
    if len(points) == 0:
        return None
    centres = (np.unique(np.floor(points / voxel_size), axis=0) + 0.5) * voxel_size
    apart = np.hypot(*(centres[:, :2] - place).T)
    near_axis = centres[apart <= STRICT.eps / 2]
    detected = DetectedVoxels(near_axis, np.ones(len(near_axis)), voxel_size)
    around = surroundings_in(centres), surroundings_in(points)
    for settings in (STRICT, LENIENT):
        found = find_towers(detected, *around, 0.5, settings)
        near = _nearest(place, found)
        if near is not None:
            return near
    return None


def _nearest(place: np.ndarray, towers: Sequence[MeasuredTower]) -> MeasuredTower | None:
    """The tower nearest to a place (2,) m, if it is as near as a hit is."""
    apart = [float(np.hypot(tower.x - place[0], tower.y - place[1])) for tower in towers]
    if not apart or min(apart) > HIT_DISTANCE_M:
        return None
    return towers[int(np.argmin(apart))]
