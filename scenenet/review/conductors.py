"""The conductors of a line, and what people decided about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.review.about import About
from scenenet.review.decisions import Said, Statements
from scenenet.review.listed_conductor import ListedConductor
from scenenet.review.reviewed_tower import Decided

SAME_WIRE_M = 0.5
"""m from a conductor up to which a place is on it. Another prediction traces a wire again within a
few centimetres, and wires hang further apart than that."""

MOST_NAMED = 10
"""Most conductors that a sentence names."""


@dataclass(frozen=True)
class ReviewedConductor:
    """A conductor, and what people say about it; attributes as ``ReviewedTower``."""

    listed: ListedConductor
    decision: Decided
    comment: str
    reviewer: str

    def to_row(self) -> dict[str, Any]:
        """Its values by column, those of the review last."""
        said = {"decision": self.decision, "comment": self.comment, "reviewer": self.reviewer}
        return {**self.listed.values, **said}

    @property
    def name(self) -> str:
        """What a sentence calls it."""
        return f"conductor {self.listed.conductor_id} of span {self.listed.span_id}"


@dataclass(frozen=True)
class ConductorReview:
    """The conductors of a survey after a review.

    Attributes:
        conductors: in their order.
        unmatched: rows about a conductor that is not there, as sentences.
    """

    conductors: tuple[ReviewedConductor, ...]
    unmatched: tuple[str, ...] = ()

    def decided(self, *decisions: Decided) -> list[ReviewedConductor]:
        """The conductors with one of these decisions."""
        return [each for each in self.conductors if each.decision in decisions]

    def counts(self) -> dict[str, int]:
        """Number of conductors with each decision, and of those with a comment."""
        return {
            "found": len(self.conductors),
            "accepted": len(self.decided("accepted")),
            "rejected": len(self.decided("rejected")),
            "not_reviewed": len(self.decided("not reviewed")),
            "comments": sum(bool(each.comment) for each in self.conductors),
        }

    def rejected(self) -> str:
        """The names of the rejected ones; empty if there is none."""
        names = [each.name for each in self.decided("rejected")]
        more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        return ", ".join(names[:MOST_NAMED]) + more


def merge_conductors(
    listed: Sequence[ListedConductor], statements: Statements, sizes: Sequence[float]
) -> tuple[ConductorReview, list[InputError]]:
    """Merge decisions with the conductors of a survey.

    Args:
        statements: with places in the system of the survey.
        sizes: in m, of the units of its x, y and z.

    Returns:
        the review, and the errors of rows that contradict another one, name no conductor, or add
        one. These conductors have no decision.
    """
    errors: list[InputError] = []
    about: dict[int, About] = {}
    unmatched: list[str] = []
    known = _Known(listed, sizes)
    for said in statements.of_conductors:
        try:
            number = known.meant(said)
        except InputError as error:
            errors.append(error)
            continue
        if number is None:
            unmatched.append(_not_there(said))
        else:
            about.setdefault(number, About("conductor")).add(said)
    reviewed = []
    for number, each in enumerate(listed):
        own = about.get(number, About("conductor"))
        errors += own.errors
        decision: Decided = "not reviewed" if own.errors else own.decision
        if decision == "not reviewed" and each.rejected:
            decision = "rejected"
        reviewed.append(ReviewedConductor(each, decision, *own.texts))
    return ConductorReview(tuple(reviewed), tuple(unmatched)), errors


class _Known:
    """The conductors of a survey, by their numbers and by place."""

    def __init__(self, listed: Sequence[ListedConductor], sizes: Sequence[float]) -> None:
        self._sizes = np.array(sizes)
        self._numbers = {each.key: number for number, each in enumerate(listed)}
        starts = [each.xyz[:-1] for each in listed]
        ways = [np.diff(each.xyz, axis=0) for each in listed]
        none = np.empty((0, 3))
        self._start, self._way = (
            np.concatenate([none, *parts]) * self._sizes for parts in (starts, ways)
        )
        self._owner = np.repeat(np.arange(len(listed)), [len(start) for start in starts])

    def meant(self, said: Said) -> int | None:
        """The number of the conductor that a row means; None if it names a place without one.

        Its place counts: another prediction may give the same conductor other numbers.

        Raises:
            InputError: it names no conductor, one that is not there, or adds one.
        """
        if said.decision == "add":
            raise said.row.error(
                "a conductor cannot be added", "Write accept, reject or comment, or delete the row"
            )
        if said.place is not None and said.z is not None:
            return self._at(np.array([*said.place, said.z]))
        if said.span is None or said.conductor is None:
            raise said.row.error(
                "it names no conductor",
                "Give its span and conductor, or the x, y and z of its middle",
            )
        number = self._numbers.get((said.span, said.conductor))
        if number is None:
            raise said.row.error(
                f"this prediction has no conductor {said.conductor} of a span {said.span}",
                "Correct the numbers, or give x, y and z of its middle: another prediction may "
                "give other numbers",
            )
        return number

    def _at(self, place: np.ndarray) -> int | None:
        """The nearest conductor to a place (3,) in the units of the survey, if it is on it."""
        if not len(self._start):
            return None
        start = self._start - place * self._sizes
        share = -(start * self._way).sum(axis=1) / (self._way**2).sum(axis=1)
        apart = np.linalg.norm(start + np.clip(share, 0, 1)[:, None] * self._way, axis=1)
        nearest = int(apart.argmin())
        return int(self._owner[nearest]) if apart[nearest] <= SAME_WIRE_M else None


def _not_there(said: Said) -> str:
    assert said.place is not None  # _meant
    x, y = said.place
    return (
        f"{said.row.file}: {said.row.place}: {said.decision}: no conductor was found within "
        f"{SAME_WIRE_M:g} m of {x:.2f}, {y:.2f}, {said.z:.2f}. Correct x, y and z, or delete the "
        "row if it is not needed any more"
    )
