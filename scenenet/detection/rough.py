"""Rough towers: candidate axes with height and continuity as the occupied voxels show them.

They say where to look. Points decide (``scenenet.detection.find``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.core.progress import labelled, track_if
from scenenet.detection.body import centre_body, measure_body
from scenenet.detection.candidates import (
    SURROUNDINGS_M,
    DetectedVoxels,
    DistinctPlaces,
    axes,
    neighbours_adjacent,
)
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.surroundings import Surroundings

LOOSE = 0.75
"""Share of the thresholds of height and continuity that a rough tower has to reach."""


@dataclass(frozen=True)
class RoughTower:
    """What voxels show on an axis.

    Attributes:
        x, y: m, centre of its body.
        base: m, elevation of the ground at its foot.
        height: m, from the base to its top.
        probability: highest probability of its voxels.
        detected: the detected voxels of the survey.
        place, reach: (2,) m and m, where its own voxels lie; a long survey has too many rough
            towers to keep the voxels of each.
    """

    x: float
    y: float
    base: float
    height: float
    probability: float
    detected: DetectedVoxels
    place: np.ndarray
    reach: float

    @property
    def voxels(self) -> np.ndarray:
        """Rows of its detected voxels."""
        return self.detected.within(self.place, self.reach)


def rough_towers(
    detected: DetectedVoxels,
    surroundings: Surroundings,
    settings: DetectionSettings,
    progress: str | None = None,
) -> list[RoughTower]:
    """The rough towers at the axes of the detected voxels, relative to ``detected.offset``.

    Axes are half of ``settings.eps`` apart, so a tower may have several.

    Args:
        progress: start of the labels of the progress on stderr; None shows no progress.
    """
    found: list[RoughTower] = []
    places, offset = DistinctPlaces(), detected.offset
    searched = axes(detected, settings, settings.eps / 2, labelled(progress, "columns searched"))
    for axis in track_if(neighbours_adjacent(searched), labelled(progress, "axes looked at")):
        around = surroundings(axis + offset[:2], SURROUNDINGS_M) - offset
        tower = _measure(detected, axis, around, settings)
        if tower is not None and places.add(tower.x, tower.y):
            found.append(tower)
    return found


def _measure(
    detected: DetectedVoxels, axis: np.ndarray, around: np.ndarray, settings: DetectionSettings
) -> RoughTower | None:
    """The rough tower on an axis (2,) m, or None if there is none.

    Args:
        around: (M, 3) m, centres of the occupied voxels within ``SURROUNDINGS_M``.
    """
    size, foot_radius = detected.voxel_size, settings.foot_radius
    min_height, min_upright = LOOSE * settings.min_height, LOOSE * settings.min_upright
    seen = detected.within(axis, settings.eps / 2)
    body = measure_body(around, axis, detected.z[seen], foot_radius, size)
    if body.height < min_height:
        return None
    # The reach of the crossarms follows from the height.
    crossarm = max(settings.eps / 2, settings.crossarm * body.height)
    place, seen = axis, detected.within(axis, crossarm)
    axis, free = centre_body(around, axis, body, size)
    if not free:
        return None
    body = measure_body(around, axis, detected.z[seen], foot_radius, size)
    if body.height < min_height or body.upright < min_upright:
        return None
    peak = float(detected.probability[seen].max())
    x, y = axis.tolist()
    return RoughTower(x, y, body.base, body.height, peak, detected, place, crossarm)
