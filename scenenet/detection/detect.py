"""From detected voxels to towers (thesis 5.1.2, last paragraph; docs/method/detection.md).

The model gives candidate axes: places where detected voxels are above one another. The body and the
conductors there are then measured in the occupied voxels, detected or not, so that a tower hardly
depends on how many of its voxels the model detects.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from scenenet.detection.body import centre_body, measure_body
from scenenet.detection.conductors import FAR, SCALES, Span, leaving_spans
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


Surroundings = Callable[[np.ndarray, float], np.ndarray]
"""A function of a position (2,) m and a radius in m, which returns the centres (M, 3) m of the
occupied voxels within this radius in plan."""

SURROUNDINGS_M = FAR + max(SCALES)
"""m, radius around an axis in which the occupied voxels are measured."""

MEAN_SHIFTS = 5
"""Number of times that an axis moves to the mean of the voxels around it; the last moves are
small."""

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
    detected = _Detected(centres - offset, probability, voxel_size)
    found = []
    for axis in _neighbours_adjacent(_axes(detected, settings)):
        around = surroundings(axis + offset[:2], SURROUNDINGS_M) - offset
        tower = _measure(detected, axis, around, tau, settings)
        if tower is not None:
            found.append(tower)
    x, y, z = (float(metres) for metres in offset)
    towers = [
        replace(tower, x=tower.x + x, y=tower.y + y, base=tower.base + z)
        for tower in _without_duplicates(found, detected, settings)
    ]
    return sorted(towers, key=lambda t: (-t.probability, t.x, t.y))


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


class _Detected:
    """Detected voxels (V, 3) m, with search by position in plan."""

    def __init__(self, centres: np.ndarray, probability: np.ndarray, voxel_size: float) -> None:
        from scipy.spatial import cKDTree

        self.centres, self.probability, self.voxel_size = centres, probability, voxel_size
        self.columns, column_of = np.unique(centres[:, :2], axis=0, return_inverse=True)
        column_of = column_of.reshape(-1)
        order = np.argsort(column_of, kind="stable")
        self._members = np.split(order, np.cumsum(np.bincount(column_of))[:-1])
        self._tree = cKDTree(self.columns)

    def columns_within(self, place: np.ndarray, radius: float) -> list[int]:
        """Columns within a planar radius in m of a position (2,) m."""
        return self._tree.query_ball_point(place, radius)

    def within(self, place: np.ndarray, radius: float) -> np.ndarray:
        """Voxels within a planar radius in m of a position (2,) m."""
        columns = sorted(self.columns_within(place, radius))
        return np.concatenate([self._members[c] for c in columns] or [np.empty(0, np.int64)])

    def mean(self, voxels: np.ndarray) -> np.ndarray:
        """(2,) m, mean position of voxels, weighted by their probabilities."""
        return np.average(self.centres[voxels, :2], axis=0, weights=self.probability[voxels])

    def tallest_first(self) -> np.ndarray:
        """Columns by their number of detected levels, neighbouring columns included, highest
        first."""
        level = np.rint(self.centres[:, 2] / self.voxel_size).astype(int)
        adjacent = self._tree.query_ball_point(self.columns, 1.5 * self.voxel_size)
        levels, total = np.empty(len(self.columns)), np.empty(len(self.columns))
        for column, neighbours in enumerate(adjacent):
            near = np.concatenate([self._members[c] for c in sorted(neighbours)])
            levels[column] = len(set(level[near].tolist()))
            total[column] = self.probability[near].sum()
        return np.lexsort((self.columns[:, 1], self.columns[:, 0], -total, -levels))


def _axes(detected: _Detected, settings: DetectionSettings) -> Iterator[np.ndarray]:
    """Positions (2,) m where detected voxels are above one another.

    Axes with more levels come first, and each axis starts at least ``eps`` from all before it.
    """
    taken = np.zeros(len(detected.columns), bool)
    for column in detected.tallest_first():
        if taken[column]:
            continue
        axis = detected.columns[column]
        for _ in range(MEAN_SHIFTS):
            body = detected.within(axis, settings.eps / 2)
            axis = detected.mean(body)
        taken[detected.columns_within(axis, settings.eps)] = True
        taken[column] = True
        extent = np.ptp(detected.centres[body, 2]) + detected.voxel_size
        if len(body) >= settings.min_voxels and extent >= settings.min_body:
            yield axis


def _neighbours_adjacent(axes: Iterable[np.ndarray]) -> list[np.ndarray]:
    """Axes in an order that keeps neighbours adjacent, because they need the same surroundings."""
    return sorted(axes, key=lambda axis: (*(axis // SURROUNDINGS_M), *axis))


def _measure(
    detected: _Detected,
    axis: np.ndarray,
    around: np.ndarray,
    tau: float,
    settings: DetectionSettings,
) -> DetectedTower | None:
    """The tower on an axis (2,) m, or None if there is none.

    Args:
        around: (M, 3) m, centres of the occupied voxels within ``SURROUNDINGS_M``.
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
        axis = detected.mean(seen)
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
    spans = leaving_spans(around, (x, y), body.base, body.height, crossarm, size)
    followed = sum(span.followed for span in spans)
    if followed < settings.min_conductor * (1 if peak >= tau else 2):
        return None
    return DetectedTower(
        x, y, body.base, body.height, width, free, body.upright, tuple(spans), peak, seen
    )


def _without_duplicates(
    found: list[DetectedTower], detected: _Detected, settings: DetectionSettings
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
