"""From detected voxels to towers (thesis 5.1.2, last paragraph; docs/method/detection.md).

The model gives candidate axes: places where detected voxels are above one another. The body and the
conductors there are then measured in the occupied voxels, detected or not, so that a tower hardly
depends on how many of its voxels the model detects.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenenet.detection.body import centre_body, measure_body
from scenenet.detection.candidates import (
    MEAN_SHIFTS,
    SURROUNDINGS_M,
    DetectedVoxels,
    axes,
    neighbours_adjacent,
)
from scenenet.detection.conductors import Span, Surroundings, leaving_spans
from scenenet.detection.settings import DetectionSettings


@dataclass(frozen=True)
class DetectedTower:
    """A detected tower.

    Attributes:
        x, y: m, centre of its body.
        base: m, elevation of the ground at its foot.
        height: m, from the base to its top.
        width: m, of its body where it stands free.
        free: share of the levels at which its body stands free.
        upright: share of the levels from foot to top with an occupied voxel.
        spans: directions in which conductors leave, the longest first.
        probability: highest probability of its voxels.
        voxels: rows of its detected voxels in the arguments of ``detect_towers``.
    """

    x: float
    y: float
    base: float
    height: float
    width: float
    free: float
    upright: float
    spans: tuple[Span, ...]
    probability: float
    voxels: np.ndarray


MIN_DISTANCE = 0.5
"""Smallest distance between two towers, as a share of the height of the first."""


def detect_towers(
    centres: np.ndarray,
    probability: np.ndarray,
    surroundings: Surroundings,
    voxel_size: float,
    tau: float,
    settings: DetectionSettings,
) -> list[DetectedTower]:
    """Find the towers among detected voxels, highest probability first.

    Args:
        centres: (V, 3) m, of the voxels with probability >= ``settings.threshold(tau)``.
        probability: (V,).
        surroundings: gives the occupied voxels around a position.
        voxel_size: m.
        tau: threshold of the model.
    """
    if len(centres) == 0:
        return []
    offset = centres.min(axis=0)
    detected = DetectedVoxels(centres - offset, probability, voxel_size)
    found = measured_axes(detected, offset, surroundings, tau, settings, settings.eps, settings)
    x, y, z = (float(metres) for metres in offset)
    towers = [
        replace(tower, x=tower.x + x, y=tower.y + y, base=tower.base + z)
        for tower in _without_duplicates(found, detected, settings)
    ]
    return sorted(towers, key=highest_probability)


def highest_probability(tower: DetectedTower) -> tuple[float, float, float]:
    """Sorting key of tower lists."""
    return -tower.probability, tower.x, tower.y


def measured_axes(
    detected: DetectedVoxels,
    offset: np.ndarray,
    surroundings: Surroundings,
    tau: float,
    settings: DetectionSettings,
    apart: float,
    tests: DetectionSettings,
) -> list[DetectedTower]:
    """The towers at the axes of the detected voxels, relative to ``offset`` (3,) m.

    Args:
        apart: m, between the starts of two axes.
        tests: settings whose thresholds a tower has to reach.
    """
    found = []
    for axis in neighbours_adjacent(axes(detected, settings, apart)):
        around = surroundings(axis + offset[:2], SURROUNDINGS_M) - offset
        tower = _measure(detected, axis, around, tau, tests, moves=apart >= settings.eps)
        if tower is not None:
            found.append(tower)
    return found


def body_voxels(
    tower: DetectedTower, occupied: np.ndarray, settings: DetectionSettings
) -> np.ndarray:
    """Which occupied voxels (M, 3) m belong to the body of a tower, detected or not: (M,) bool.

    Detected voxels outside the body, such as crossarms, are in ``DetectedTower.voxels``.
    """
    distance = np.hypot(occupied[:, 0] - tower.x, occupied[:, 1] - tower.y)
    level = occupied[:, 2] - tower.base
    reach = max(settings.body, tower.width / 2 + settings.beside_body)
    return (distance <= reach) & (level >= settings.foot) & (level <= tower.height)


def surroundings_in(places: np.ndarray) -> Surroundings:
    """The surroundings among all occupied voxels (M, 3) m in memory."""

    def near(place: np.ndarray, radius: float) -> np.ndarray:
        return places[np.hypot(places[:, 0] - place[0], places[:, 1] - place[1]) <= radius]

    return near


def _measure(
    detected: DetectedVoxels,
    axis: np.ndarray,
    around: np.ndarray,
    tau: float,
    settings: DetectionSettings,
    *,
    moves: bool,
) -> DetectedTower | None:
    """The tower on an axis (2,) m, or None if there is none.

    Args:
        around: (M, 3) m, centres of the occupied voxels within ``SURROUNDINGS_M``.
        moves: whether the axis moves to the mean of the detected voxels within the reach of the
            crossarms. Two towers that are closer than this would become one.
    """
    size, foot_radius = detected.voxel_size, settings.foot_radius
    seen = detected.within(axis, settings.eps / 2)
    body = measure_body(around, axis, detected.centres[seen, 2], foot_radius, size)
    if body.height < settings.min_height:
        return None
    # The reach of the crossarms follows from the height.
    crossarm = max(settings.eps / 2, settings.crossarm * body.height)
    for _ in range(MEAN_SHIFTS):
        seen = detected.within(axis, crossarm)
        axis = detected.mean(seen) if moves else axis
    peak = float(detected.probability[seen].max())
    axis, width, free = centre_body(around, axis, body, size)
    # The cheapest tests come first.
    if free == 0 or (peak < tau and free < settings.min_free):
        return None
    body = measure_body(around, axis, detected.centres[seen, 2], foot_radius, size)
    if body.height < settings.min_height or body.upright < settings.min_upright:
        return None
    x, y = float(axis[0]), float(axis[1])
    crossarm = max(settings.eps / 2, settings.crossarm * body.height)
    spans = []
    if settings.min_conductor > 0:
        spans = leaving_spans(around, (x, y), body.base, body.height, crossarm, size)
    followed = sum(span.followed for span in spans)
    if followed < settings.min_conductor * (1 if peak >= tau else 2):
        return None
    return DetectedTower(
        x, y, body.base, body.height, width, free, body.upright, tuple(spans), peak, seen
    )


def _without_duplicates(
    found: list[DetectedTower], detected: DetectedVoxels, settings: DetectionSettings
) -> list[DetectedTower]:
    """One tower for each group of close axes, with all its detected voxels.

    A tower may have several axes, on its legs or crossarms. The one with the tallest free-standing
    body is kept.
    """
    towers: list[DetectedTower] = []
    taken = np.zeros(len(detected.centres), bool)

    def free_height(tower: DetectedTower) -> float:
        return tower.free * tower.upright * tower.height

    for tower in sorted(found, key=lambda t: (-free_height(t), -t.probability, t.x, t.y)):
        if any(
            np.hypot(tower.x - t.x, tower.y - t.y) <= max(settings.eps, MIN_DISTANCE * t.height)
            for t in towers
        ):
            continue
        reach = max(settings.eps, settings.crossarm * tower.height)
        near = np.union1d(detected.within(np.array([tower.x, tower.y]), reach), tower.voxels)
        voxels = near[~taken[near]]
        if len(voxels) == 0:  # all its voxels belong to another tower
            continue
        taken[voxels] = True
        towers.append(replace(tower, voxels=voxels))
    return towers
