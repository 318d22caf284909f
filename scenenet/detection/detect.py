"""From detected voxels to towers (thesis 5.1.2, last paragraph; docs/method/detection.md).

The model says where to look: an axis is put where detected voxels stand above one another. What
stands there is then measured in the occupied voxels, detected or not, so that a tower does not
depend on how much of it a model finds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from scenenet.detection.body import middle, standing
from scenenet.detection.conductors import FAR, SCALES, Span, leaving_spans
from scenenet.detection.settings import DetectionSettings


@dataclass(frozen=True)
class DetectedTower:
    """A tower found in a prediction.

    Attributes:
        x, y: m, middle of its body.
        base: m, elevation of the ground at its foot.
        height: m, from there to its top.
        width: m, of its body where it stands free.
        free: share of its body that stands free.
        upright: share of the levels from foot to top at which something stands.
        spans: directions in which wires leave, the longest first.
        probability: highest probability among its voxels.
        voxels: positions of its detected voxels in what was passed to ``detect_towers``.
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
"""(2,) m and a radius in m to the (M, 3) m middles of the occupied voxels that near in plan."""

LOOK_M = FAR + max(SCALES)
"""How far around an axis the occupied voxels are asked for."""

MEANS = 5
"""Means over the voxels about an axis, each about the one before, that put it in their midst; the
last ones hardly move it."""

APART = 0.5
"""Of its height: how far from a tower the next one stands at least."""


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
        centres: (V, 3) m, middles of the voxels with probability >= ``settings.threshold(tau)``.
        probability: (V,).
        surroundings: tells the occupied voxels around a place.
        voxel_size: m.
    """
    if len(centres) == 0:
        return []
    offset = centres.min(axis=0)
    detected = _Detected(centres - offset, probability, voxel_size)
    found = []
    for axis in _neighbours_together(_axes(detected, settings)):
        around = surroundings(axis + offset[:2], LOOK_M) - offset
        tower = _measure(detected, axis, around, tau, settings)
        if tower is not None:
            found.append(tower)
    x, y, z = (float(metres) for metres in offset)
    towers = [
        replace(tower, x=tower.x + x, y=tower.y + y, base=tower.base + z)
        for tower in _one_of_each(found, detected, settings)
    ]
    return sorted(towers, key=lambda t: (-t.probability, t.x, t.y))


def body_voxels(
    tower: DetectedTower, occupied: np.ndarray, settings: DetectionSettings
) -> np.ndarray:
    """Which occupied voxels (M, 3) m are of a tower's body, detected or not: (M,) bool.

    What reaches tau beside the body, at crossarms, is the tower's as well: see
    ``DetectedTower.voxels``.
    """
    distance = np.hypot(occupied[:, 0] - tower.x, occupied[:, 1] - tower.y)
    level = occupied[:, 2] - tower.base
    reach = max(settings.body, tower.width / 2 + settings.beside_body)
    return (distance <= reach) & (level >= settings.foot) & (level <= tower.height)


def among(places: np.ndarray) -> Surroundings:
    """The surroundings where all occupied voxels (M, 3) m are at hand."""

    def near(place: np.ndarray, radius: float) -> np.ndarray:
        return places[np.hypot(places[:, 0] - place[0], places[:, 1] - place[1]) <= radius]

    return near


class _Detected:
    """Detected voxels (V, 3) m, to be found by their place in plan."""

    def __init__(self, centres: np.ndarray, probability: np.ndarray, voxel_size: float) -> None:
        from scipy.spatial import cKDTree

        self.centres, self.probability, self.voxel_size = centres, probability, voxel_size
        self.columns, column_of = np.unique(centres[:, :2], axis=0, return_inverse=True)
        column_of = column_of.reshape(-1)
        order = np.argsort(column_of, kind="stable")
        self._members = np.split(order, np.cumsum(np.bincount(column_of))[:-1])
        self._tree = cKDTree(self.columns)

    def columns_within(self, place: np.ndarray, radius: float) -> list[int]:
        """Columns within a planar radius in m of a place (2,) m."""
        return self._tree.query_ball_point(place, radius)

    def within(self, place: np.ndarray, radius: float) -> np.ndarray:
        """Voxels within a planar radius in m of a place (2,) m."""
        columns = sorted(self.columns_within(place, radius))
        return np.concatenate([self._members[c] for c in columns] or [np.empty(0, np.int64)])

    def mean(self, voxels: np.ndarray) -> np.ndarray:
        """(2,) m, mean place of voxels, each weighted by its probability."""
        return np.average(self.centres[voxels, :2], axis=0, weights=self.probability[voxels])

    def tallest_first(self) -> np.ndarray:
        """Columns, those with most detected levels in them or in a column beside them first."""
        level = np.rint(self.centres[:, 2] / self.voxel_size).astype(int)
        touching = self._tree.query_ball_point(self.columns, 1.5 * self.voxel_size)
        levels, certain = np.empty(len(self.columns)), np.empty(len(self.columns))
        for column, beside in enumerate(touching):
            near = np.concatenate([self._members[c] for c in sorted(beside)])
            levels[column] = len(set(level[near].tolist()))
            certain[column] = self.probability[near].sum()
        return np.lexsort((self.columns[:, 1], self.columns[:, 0], -certain, -levels))


def _axes(detected: _Detected, settings: DetectionSettings) -> Iterator[np.ndarray]:
    """Places (2,) m where detected voxels stand above one another.

    The next axis begins at least ``eps`` from those before it, at which more stand above one
    another.
    """
    taken = np.zeros(len(detected.columns), bool)
    for column in detected.tallest_first():
        if taken[column]:
            continue
        axis = detected.columns[column]
        for _ in range(MEANS):
            body = detected.within(axis, settings.eps / 2)
            axis = detected.mean(body)
        taken[detected.columns_within(axis, settings.eps)] = True
        taken[column] = True
        extent = np.ptp(detected.centres[body, 2]) + detected.voxel_size
        if len(body) >= settings.min_voxels and extent >= settings.min_body:
            yield axis


def _neighbours_together(axes: Iterable[np.ndarray]) -> list[np.ndarray]:
    """Axes in an order in which those near one another need the same surroundings."""
    return sorted(axes, key=lambda axis: (*(axis // LOOK_M), *axis))


def _measure(
    detected: _Detected,
    axis: np.ndarray,
    around: np.ndarray,
    tau: float,
    settings: DetectionSettings,
) -> DetectedTower | None:
    """The tower on an axis (2,) m, or None where what stands there is none.

    Args:
        around: (M, 3) m, middles of the occupied voxels within ``LOOK_M``.
    """
    size, foot_radius = detected.voxel_size, settings.foot_radius
    seen = detected.within(axis, settings.eps / 2)
    body = standing(around, axis, detected.centres[seen, 2], foot_radius, size)
    if body.height < settings.min_height:
        return None
    # Now that its height is known, it is known how far it reaches.
    crossarm = max(settings.eps / 2, settings.crossarm * body.height)
    for _ in range(MEANS):
        seen = detected.within(axis, crossarm)
        axis = detected.mean(seen)
    peak = float(detected.probability[seen].max())
    axis, width, free = middle(around, axis, body, size)
    # What costs least is asked first.
    if free == 0 or (peak < tau and free < settings.min_free):
        return None
    body = standing(around, axis, detected.centres[seen, 2], foot_radius, size)
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


def _one_of_each(
    found: list[DetectedTower], detected: _Detected, settings: DetectionSettings
) -> list[DetectedTower]:
    """Towers with the voxels that are theirs.

    One tower may have several axes, at its legs or on a crossarm. That on which most stands, and
    stands free, is its own.
    """
    towers: list[DetectedTower] = []
    taken = np.zeros(len(detected.centres), bool)

    def stands(tower: DetectedTower) -> float:
        return tower.free * tower.upright * tower.height

    for tower in sorted(found, key=lambda t: (-stands(t), -t.probability, t.x, t.y)):
        if any(
            np.hypot(tower.x - t.x, tower.y - t.y) <= max(settings.eps, APART * t.height)
            for t in towers
        ):
            continue
        reach = max(settings.eps, settings.crossarm * tower.height)
        near = np.union1d(detected.within(np.array([tower.x, tower.y]), reach), tower.voxels)
        mine = near[~taken[near]]
        if len(mine) == 0:  # all that was seen of it is another's
            continue
        taken[mine] = True
        towers.append(replace(tower, voxels=mine))
    return towers
