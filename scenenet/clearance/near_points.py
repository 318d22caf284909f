"""The points near the conductors of a span."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.clearance.distance import bounds, nearest_on
from scenenet.clearance.settings import KINDS, ClearanceLimits
from scenenet.line.records import Conductor

POINT_KINDS = KINDS[:3]
"""The kinds of points; wires are measured as catenaries."""


@dataclass(frozen=True)
class NearPoint:
    """A point near a conductor.

    Attributes:
        conductor: it is near to.
        kind: one of ``POINT_KINDS``.
        xyz: (3,) m.
        along: m, of the nearest place on the conductor.
        distance: m, in space.
    """

    conductor: Conductor
    kind: str
    xyz: np.ndarray
    along: float
    distance: float


@dataclass(frozen=True)
class TooNear:
    """Points that are closer than the limit to a conductor.

    Attributes:
        xyz: (n, 3) m.
        kind: (n,) number in ``POINT_KINDS``.
        conductor: (n,) id of the nearest conductor of the span.
        along, distance: (n,) m, as ``NearPoint``.
        low: (n,) bool, which are close above the ground.
    """

    xyz: np.ndarray
    kind: np.ndarray
    conductor: np.ndarray
    along: np.ndarray
    distance: np.ndarray
    low: np.ndarray

    @classmethod
    def together(cls, parts: Sequence[TooNear]) -> TooNear:
        """All points of several, at least one."""
        names = ("xyz", "kind", "conductor", "along", "distance", "low")
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


@dataclass(frozen=True)
class Near:
    """What is near the conductors of a span.

    Attributes:
        nearest: of each conductor and kind, if there is one.
        steps: (number of the step, nearest point to a conductor) of each step along the span and
            kind, if there is one.
        too_near: closer than the limits.
    """

    nearest: tuple[NearPoint, ...]
    steps: tuple[tuple[int, NearPoint], ...]
    too_near: TooNear


def near_points(
    xyz: np.ndarray,
    kind: np.ndarray,
    step: np.ndarray,
    conductors: Sequence[Conductor],
    limits: ClearanceLimits | None,
    lone: np.ndarray,
    low: np.ndarray,
) -> Near:
    """The nearest of points to conductors, and those that are too near.

    A lone point can be too near, and is not the nearest of its kind.

    Args:
        xyz: (n, 3) m.
        kind: (n,) number in ``POINT_KINDS``.
        step: (n,) number of the step along the span.
        lone: (n,) bool, which points are lone ones.
        low: (n,) bool, which are close above the ground.
        conductors: of the span.
        limits: for the voltage, also of earth wires, because a conductor may be taken for one. None
            without a voltage.
    """
    limit_of = np.array([limits.of(name) if limits else 0.0 for name in POINT_KINDS])
    limit = limit_of[kind]
    cell = step * len(POINT_KINDS) + kind
    nearest: list[NearPoint] = []
    steps: dict[int, NearPoint] = {}
    closest, owner, at = np.full(len(xyz), np.inf), np.zeros(len(xyz), int), np.zeros(len(xyz))
    for conductor in conductors:
        lower, upper = bounds(conductor.catenary, xyz)
        best = np.full(int(cell.max(initial=0)) + 1, np.inf)
        np.minimum.at(best, cell[~lone], upper[~lone])
        rows = np.flatnonzero((~lone & (lower <= best[cell])) | (lower < limit))
        exact = nearest_on(conductor.catenary, xyz[rows])
        # Sorted by distance, the first row of a group is its nearest point.
        order = np.argsort(exact.distance, kind="stable")
        rows, along, distance = rows[order], exact.along[order], exact.distance[order]
        joined = np.flatnonzero(~lone[rows])
        _, first = np.unique(kind[rows[joined]], return_index=True)
        for place in joined[first].tolist():
            row = rows[place]
            nearest.append(_near(conductor, kind[row], xyz[row], along[place], distance[place]))
        cells, first = np.unique(cell[rows[joined]], return_index=True)
        for each, place in zip(cells.tolist(), joined[first].tolist(), strict=True):
            if each not in steps or distance[place] < steps[each].distance:
                row = rows[place]
                steps[each] = _near(conductor, kind[row], xyz[row], along[place], distance[place])
        closer = (distance < limit[rows]) & (distance < closest[rows])
        own = rows[closer]
        closest[own], at[own], owner[own] = distance[closer], along[closer], conductor.conductor_id
    found = np.flatnonzero(np.isfinite(closest))
    too_near = TooNear(xyz[found], kind[found], owner[found], at[found], closest[found], low[found])
    by_step = tuple((each // len(POINT_KINDS), steps[each]) for each in sorted(steps))
    return Near(tuple(nearest), by_step, too_near)


def _near(
    conductor: Conductor, kind: int, xyz: np.ndarray, along: float, distance: float
) -> NearPoint:
    """A point of a kind, by its number."""
    return NearPoint(conductor, POINT_KINDS[kind], xyz, float(along), float(distance))
