"""One tower for each structure, of all that candidate axes led to."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Generic, TypeVar

import numpy as np

from scenenet.detection.conductor_rules import BESIDE_M, HEAD, POLE_M, SHORTEST_SPAN_M
from scenenet.detection.joined import PLANE_M, joined, tower_of
from scenenet.detection.line_frame import across, sides_of
from scenenet.detection.measured_tower import MeasuredTower
from scenenet.detection.surroundings import Surroundings

APART_M = 2.0
"""m, smallest distance between two towers, measured in points."""

LEVEL_M, BRACED = 1.0, 0.25
"""m, height of the levels between two poles, and the share of them up to which there are points,
of bushes, where no brace is. A lattice has braces at most levels, also with few points."""

CELL_M = 200.0
"""m, edge of the cells in which towers are looked up: nothing here compares towers that are further
apart, since a beam is shorter than half of the tallest tower."""

Item = TypeVar("Item")


def same_axis(one: MeasuredTower, other: MeasuredTower) -> bool:
    """Whether two axes are too close for two towers of any width."""
    return bool(np.hypot(one.x - other.x, one.y - other.y) <= APART_M)


def distinct_towers(found: list[MeasuredTower], points: Surroundings) -> list[MeasuredTower]:
    """One tower for each structure: several axes may have led to its body, and to its legs.

    Args:
        found: those that the axes led to.
        points: gives the points around a position.
    """
    bodies: list[MeasuredTower] = []
    kept: _Places[MeasuredTower] = _Places()
    for tower in sorted(found, key=_best_first):
        if not any(_same_body(tower, other) for other in kept.near(tower)):
            bodies.append(tower)
            kept.add(tower, tower)
    bodies = [body for body in bodies if not _is_air_between_poles(body, kept, points)]
    towers: list[MeasuredTower] = []
    best: _Places[MeasuredTower] = _Places()
    # Not the tallest: a tree under conductors seems to reach up to them, as high as the tower does.
    for tower in sorted(map(_whole, _joined(bodies, points)), key=_best_first):
        if not any(_under_conductors(tower, other) for other in best.near(tower)):
            towers.append(tower)
            best.add(tower, tower)
    return towers


class _Places(Generic[Item]):
    """Items at the places of towers, so that a long line takes no longer for each of its towers."""

    def __init__(self) -> None:
        self._cells: defaultdict[tuple[int, int], list[Item]] = defaultdict(list)

    def add(self, tower: MeasuredTower, item: Item) -> None:
        """Add an item at the place of a tower."""
        self._cells[self._cell(tower)].append(item)

    def near(self, tower: MeasuredTower) -> Iterator[Item]:
        """The items up to ``CELL_M`` m from a tower, and some that are further away."""
        x, y = self._cell(tower)
        for east, north in product((-1, 0, 1), repeat=2):
            yield from self._cells.get((x + east, y + north), ())

    @staticmethod
    def _cell(tower: MeasuredTower) -> tuple[int, int]:
        return int(tower.x // CELL_M), int(tower.y // CELL_M)


def _best_first(tower: MeasuredTower) -> tuple[bool, float, float, float]:
    """The key that sorts the body that stands most free first, and portals before their poles."""
    portal = tower.structure.apart > 0
    return not portal, -tower.free * tower.upright * tower.height, tower.x, tower.y


def _same_body(one: MeasuredTower, other: MeasuredTower) -> bool:
    """Whether two bodies are one, seen from axes that are close or along the line.

    Side by side, a body and another in it may be a leg and the tower it belongs to.
    """
    return same_axis(one, other) or (_overlap(one, other) and not _in_plane(one, other))


def _overlap(one: MeasuredTower, other: MeasuredTower) -> bool:
    """Whether two bodies are in one another."""
    apart = one.width / 2 + other.width / 2
    return bool(np.hypot(one.x - other.x, one.y - other.y) <= apart)


def _in_plane(one: MeasuredTower, other: MeasuredTower) -> bool:
    """Whether two bodies stand in one plane across the line, as seen from the first."""
    offset = np.array([other.x - one.x, other.y - one.y])
    return bool(abs(offset @ one.structure.along) <= PLANE_M)


def _is_air_between_poles(
    body: MeasuredTower, others: _Places[MeasuredTower], points: Surroundings
) -> bool:
    """Whether a wide body is two poles and the air between them.

    A prism around both has points at every level and none beside it, as that of a lattice has. But
    a lattice has braces below its crossarms.
    """
    if body.width <= POLE_M:
        return False
    shape, right = body.structure, across(body.structure.along)
    poles = [
        float(np.array([other.x - body.x, other.y - body.y]) @ right)
        for other in others.near(body)
        if other.width <= POLE_M and _overlap(body, other) and _in_plane(body, other)
    ]
    if not poles or not min(poles) < 0 < max(poles):
        return False
    s, t, h = shape.frame(points(np.array([body.x, body.y]), shape.reach))
    high = HEAD * body.height
    inside = shape.in_body(s, t, h) & (h <= high)
    for at in poles:
        inside &= np.maximum(np.abs(s), np.abs(t - at)) > POLE_M / 2
    levels = np.unique(np.floor((h[inside] - shape.foot) / LEVEL_M))
    return bool(len(levels) <= BRACED * (high - shape.foot) / LEVEL_M)


def _joined(bodies: list[MeasuredTower], points: Surroundings) -> list[list[MeasuredTower]]:
    """The bodies of each tower: one, or several that beams join."""
    towers: dict[int, list[MeasuredTower]] = {}
    number_of: dict[int, int] = {}
    places: _Places[int] = _Places()
    for number, body in enumerate(bodies):
        # A leg may be joined to the body amid the conductors and to the other leg.
        own = [body]
        for near in sorted({number_of[other] for other in places.near(body)}):
            if any(
                _overlap(body, other) or joined(body.structure, other.structure, points)
                for other in towers[near]
            ):
                own += towers.pop(near)
        towers[number] = own
        number_of |= {id(part): number for part in own}
        places.add(body, id(body))
    return list(towers.values())


def _whole(parts: list[MeasuredTower]) -> MeasuredTower:
    """The tower to which joined bodies belong."""
    if len(parts) == 1:
        return parts[0]
    shape = tower_of([part.structure for part in parts])
    nearest = min(parts, key=lambda part: np.hypot(part.x - shape.x, part.y - shape.y))
    base = shape.ground.elevation
    return replace(nearest, x=shape.x, y=shape.y, base=base, height=shape.height, structure=shape)


def _under_conductors(tower: MeasuredTower, other: MeasuredTower) -> bool:
    """Whether what seems to be a tower stands under the conductors of another that is near.

    Towers side by side, in one plane across their lines, may be as near as they like.
    """
    along = other.structure.along
    offset = np.array([tower.x - other.x, tower.y - other.y])
    # Not every conductor may be seen at the tower; its crossarms are as long as they need to be.
    arms = other.structure.head.reach
    sides = (-arms, arms, *sides_of(other.spans, along))
    right = float(offset @ across(along))
    return (
        tower.width > POLE_M
        and PLANE_M < abs(offset @ along) <= SHORTEST_SPAN_M
        and min(sides) - BESIDE_M <= right <= max(sides) + BESIDE_M
    )
