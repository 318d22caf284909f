"""Rough towers: candidate axes with height and continuity as the occupied voxels show them.

They say where to look. Points decide (``scenenet.detection.find``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from typing import overload

import numpy as np

from scenenet.core.progress import labelled, track_if
from scenenet.detection.body import centre_body, centre_pole, measure_body
from scenenet.detection.candidates import (
    SURROUNDINGS_M,
    DistinctPlaces,
    axes,
    neighbours_adjacent,
)
from scenenet.detection.conductor_rules import POLE_M
from scenenet.detection.detected_voxels import DetectedSurvey
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.surroundings import Surroundings

LOOSE = 0.75
"""Share of the thresholds of height and continuity that a rough tower has to reach."""

BLOCK_M = 1000.0
"""m, edge of the blocks in which axes are looked at one after another."""


@dataclass(frozen=True)
class RoughTower:
    """What voxels show on an axis.

    Attributes:
        x, y: m, centre of its body.
        base: m, elevation of the ground at its foot.
        height: m, from the base to its top.
        probability: highest probability of its voxels.
        place_x, place_y, reach: m, within which planar radius of which place its own voxels lie.
        pole: whether it was looked for as a pole, so that a wider body there is not the one.
    """

    x: float
    y: float
    base: float
    height: float
    probability: float
    place_x: float
    place_y: float
    reach: float
    pole: bool


class RoughTowers(Sequence[RoughTower]):
    """Rough towers, of which a long survey has too many to keep an object for each."""

    def __init__(self, rows: np.ndarray) -> None:
        """``rows`` (N, 9) has the attributes of each, in their order."""
        self._rows = rows

    def __len__(self) -> int:
        return len(self._rows)

    @overload
    def __getitem__(self, at: int) -> RoughTower: ...

    @overload
    def __getitem__(self, at: slice) -> RoughTowers: ...

    def __getitem__(self, at: int | slice) -> RoughTower | RoughTowers:
        if isinstance(at, slice):
            return RoughTowers(self._rows[at])
        x, y, base, height, probability, place_x, place_y, reach, pole = self._rows[at].tolist()
        own = place_x, place_y, reach, bool(pole)
        return RoughTower(x, y, base, height, probability, *own)


def rough_towers(
    detected: DetectedSurvey,
    surroundings: Surroundings,
    settings: DetectionSettings,
    progress: str | None = None,
) -> RoughTowers:
    """The rough towers at the axes of the detected voxels, relative to ``detected.offset``.

    Axes are half of ``settings.eps`` apart, so a tower may have several.

    Args:
        progress: start of the labels of the progress on stderr; None shows no progress.
    """
    offset = detected.offset
    label = labelled(progress, "areas searched")
    searched = neighbours_adjacent(axes(detected, settings, settings.eps / 2, label))
    rows = np.full((len(searched), 2, len(fields(RoughTower))), np.nan)
    # Block by block, because ``detected`` has not all in memory.
    order = np.lexsort((np.arange(len(searched)), *(searched // BLOCK_M).T))
    for row in track_if(order, labelled(progress, "places looked at")):
        axis = searched[row]
        around = surroundings(axis + offset[:2], SURROUNDINGS_M) - offset
        for number, tower in enumerate(_measure(detected, axis, around, settings)):
            rows[row, number] = astuple(tower)
    rows, places = rows[~np.isnan(rows[..., 0])], DistinctPlaces()
    return RoughTowers(rows[[places.add(x, y) for x, y in rows[:, :2].tolist()]])


def _measure(
    detected: DetectedSurvey, axis: np.ndarray, around: np.ndarray, settings: DetectionSettings
) -> list[RoughTower]:
    """The rough towers on an axis (2,) m: one whose body is around it, and a pole that stands on it
    where the middle of that body is elsewhere, between two poles.

    Args:
        around: (M, 3) m, centres of the occupied voxels within ``SURROUNDINGS_M``.
    """
    size, foot_radius = detected.voxel_size, settings.foot_radius
    min_height, min_upright = LOOSE * settings.min_height, LOOSE * settings.min_upright
    voxels = detected.around(axis, settings.eps / 2)
    seen = voxels.within(axis, settings.eps / 2)
    body = measure_body(around, axis, voxels.z[seen], foot_radius, size)
    if body.height < min_height:
        return []
    # The reach of the crossarms follows from the height.
    crossarm = max(settings.eps / 2, settings.crossarm * body.height)
    voxels = detected.around(axis, crossarm)
    seen = voxels.within(axis, crossarm)
    peak = float(voxels.probability[seen].max())
    middle, free = centre_body(around, axis, body, size)
    centres = [(middle, False)] if free else []
    if not free or np.hypot(*(middle - axis)) > POLE_M:
        place = centre_pole(around, axis, body, size)
        centres += [] if place is None else [(place, True)]
    found = []
    for centre, pole in centres:
        body = measure_body(around, centre, voxels.z[seen], foot_radius, size)
        if body.height >= min_height and body.upright >= min_upright:
            (x, y), (place_x, place_y) = centre.tolist(), axis.tolist()
            own = place_x, place_y, crossarm, pole
            found.append(RoughTower(x, y, body.base, body.height, peak, *own))
    return found
