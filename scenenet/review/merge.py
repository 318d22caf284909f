"""Decisions merged with the towers and conductors that were found."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.detection.distinct import APART_M
from scenenet.detection.tower_ids import EAST, NORTH, tower_ids
from scenenet.metrics.tower_matching import HIT_DISTANCE_M
from scenenet.review.about import About
from scenenet.review.conductors import ConductorReview, merge_conductors
from scenenet.review.decisions import Said, Statements
from scenenet.review.found_list import FoundList, ListedTower
from scenenet.review.reviewed_tower import Decided, ReviewedTower


@dataclass(frozen=True)
class Review:
    """A tower list after a review.

    Attributes:
        towers: of the list, in its order, then those that were added.
        conductors: of the line; None where the list has none.
        unmatched: rows that name a place where no tower or conductor was found, as sentences.
        warnings: what looks wrong, as sentences.
        undecided: number of rows that say nothing.
    """

    towers: tuple[ReviewedTower, ...]
    unmatched: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    undecided: int = 0
    conductors: ConductorReview | None = None

    def decided(self, *decisions: Decided) -> list[ReviewedTower]:
        """The towers with one of these decisions."""
        return [tower for tower in self.towers if tower.decision in decisions]

    @property
    def kept(self) -> list[ReviewedTower]:
        """The towers that were not rejected."""
        return self.decided("accepted", "not reviewed", "added")

    def counts(self) -> dict[str, int]:
        """Number of towers with each decision, and of those with a comment."""
        return {
            "found": len(self.towers) - len(self.decided("added")),
            "accepted": len(self.decided("accepted")),
            "rejected": len(self.decided("rejected")),
            "added": len(self.decided("added")),
            "not_reviewed": len(self.decided("not reviewed")),
            "comments": sum(bool(tower.comment) for tower in self.towers),
        }


def merge(found: FoundList, statements: Statements) -> tuple[Review, list[InputError]]:
    """Merge decisions with a tower list.

    Args:
        statements: of ``read_decisions``.

    Returns:
        the review, and the errors of rows that name nothing, contradict another row, or add a
        tower where one stands. With an error the review is not complete.
    """
    errors = list(statements.errors)
    known = _Towers(found)
    about: dict[int, About] = {}
    unmatched: list[str] = []
    for said in statements.of_towers:
        if said.decision == "add":
            continue
        try:
            tower = known.meant(said)
        except InputError as error:
            errors.append(error)
            continue
        if tower is None:
            unmatched.append(_no_tower(said))
        else:
            about.setdefault(tower.id, About()).add(said)
    errors += [error for each in about.values() for error in each.errors]
    towers = [_reviewed(tower, about.get(tower.id, About())) for tower in found.towers]
    rejected = {tower.id for tower in towers if tower.decision == "rejected"}
    taken = {tower.id for tower in towers}
    added: list[ReviewedTower] = []
    for said in statements.of_towers:
        if said.decision != "add":
            continue
        try:
            _require_free(said, known, rejected, added, found.unit_sizes[0])
            added.append(_added(said, found, taken))
            taken.add(added[-1].id)
        except InputError as error:
            errors.append(error)
    conductors = None
    if found.conductors or statements.of_conductors:
        conductors, faults = merge_conductors(found.conductors, statements, found.unit_sizes)
        errors += faults
        unmatched += conductors.unmatched
    review = Review(
        (*towers, *added), tuple(unmatched), tuple(_outside(added, found)), statements.undecided,
        conductors,
    )  # fmt: skip
    return review, errors


class _Towers:
    """The towers of a list, by id and by place."""

    def __init__(self, found: FoundList) -> None:
        from scipy.spatial import cKDTree

        self._found, self._size = found, found.unit_sizes[0]
        self._by_id = {tower.id: tower for tower in found.towers}
        self._tree = cKDTree(found.places * self._size) if found.towers else None

    def meant(self, said: Said) -> ListedTower | None:
        """The tower that a row means; None if it stands at a place without one.

        Raises:
            InputError: it names no tower, one that is not in the list, or one that stands
                elsewhere.
        """
        if said.id is None:
            if said.place is None:
                raise said.row.error("it names no tower", "Give its id, or its x and y")
            # The nearest one, if it is as near as a hit is.
            near = self.within(said.place, HIT_DISTANCE_M)
            return near[0] if near else None
        tower = self._by_id.get(said.id)
        if tower is None:
            raise said.row.error(
                f"no tower of {self._found.path.name} has the id {said.id}",
                "Correct the id, or leave it empty and give x and y",
            )
        if said.place is not None:
            x, y = said.place
            apart = float(np.hypot(tower.x - x, tower.y - y)) * self._size
            if apart > HIT_DISTANCE_M:
                raise said.row.error(
                    f"tower {said.id} stands {apart:.1f} m from the coordinates of this row",
                    "Correct the id or the coordinates. To move a tower, reject it and add it "
                    "again",
                )
        return tower

    def within(self, place: tuple[float, float], radius: float) -> list[ListedTower]:
        """The towers within a radius in m of a place in the units of the survey, nearest first."""
        if self._tree is None:
            return []
        at = np.array(place) * self._size
        rows = self._tree.query_ball_point(at, radius)
        apart = np.hypot(*(self._tree.data[rows] - at).T)
        return [self._found.towers[rows[number]] for number in np.argsort(apart, kind="stable")]


def _no_tower(said: Said) -> str:
    x, y = said.place or (np.nan, np.nan)
    return (
        f"{said.row.file}: {said.row.place}: {said.decision}: no tower was found within "
        f"{HIT_DISTANCE_M:g} m of {x:.2f}, {y:.2f}"
    )


def _reviewed(tower: ListedTower, about: About) -> ReviewedTower:
    return ReviewedTower(
        tower.id,
        tower.x,
        tower.y,
        tower.values.get("base"),
        tower.values,
        about.decision,
        *about.texts,
    )


def _require_free(
    said: Said,
    known: _Towers,
    rejected: Set[int],
    added: Sequence[ReviewedTower],
    size: float,
) -> None:
    """Refuse to add a tower where one stands.

    Args:
        rejected: ids of the towers that no longer count.
        added: what other rows add.
        size: m, of a unit in plan.

    Raises:
        InputError: a tower stands there, or the row has no coordinates.
    """
    if said.place is None:
        raise said.row.error("a tower is added without coordinates", "Give its x and y")
    for other in known.within(said.place, APART_M):
        if other.id not in rejected:
            raise said.row.error(
                f"a tower is added within {APART_M:g} m of tower {other.id}",
                f"Accept tower {other.id}, or reject it in another row",
            )
    x, y = said.place
    for new in added:
        if np.hypot(new.x - x, new.y - y) * size <= APART_M:
            raise said.row.error(
                f"a tower is added within {APART_M:g} m of one that another row adds",
                "Delete one of the two rows",
            )


def _added(said: Said, found: FoundList, taken: Set[int]) -> ReviewedTower:
    """The tower that a row adds.

    Args:
        taken: ids of all towers.

    Raises:
        InputError: the row has an id.
    """
    if said.id is not None:
        raise said.row.error(
            f"a tower is added with the id {said.id}",
            "Leave the id empty: it follows from the place",
        )
    assert said.place is not None  # _require_free
    x, y = said.place
    values: dict[str, Any] = dict.fromkeys(found.columns)
    number = _free_id(np.array([[x, y]]) * found.unit_sizes[0], taken)
    values |= {"id": number, "x": x, "y": y}
    values |= {n: v for n, v in (("base", said.base), ("height", said.height)) if n in values}
    return ReviewedTower(number, x, y, said.base, values, "added", said.comment, said.reviewer)


def _free_id(place: np.ndarray, taken: Set[int]) -> int:
    """The id of a tower at a place (1, 2) m, or the next one that is free."""
    [number] = tower_ids(place)
    while number in taken or number == 0:
        number = (number + 1) % (EAST * NORTH)
    return number


def _outside(added: Sequence[ReviewedTower], found: FoundList) -> list[str]:
    """What is said about added towers where the survey has no points."""
    import shapely

    if found.coverage is None:
        return []
    return [
        f"tower {tower.id}, which was added at {tower.x:.2f}, {tower.y:.2f}, stands outside the "
        "coverage of the survey"
        for tower in added
        if not shapely.covers(found.coverage, shapely.Point(tower.x, tower.y))
    ]
