"""What rows of review files say about one tower or conductor."""

from __future__ import annotations

from dataclasses import dataclass, field

from scenenet.core.errors import InputError
from scenenet.review.decisions import Decision, Said
from scenenet.review.reviewed_tower import Decided


@dataclass
class About:
    """What was said about one tower or conductor.

    Attributes:
        what: the word for it.
    """

    what: str = "tower"
    said: list[Said] = field(default_factory=list)
    errors: list[InputError] = field(default_factory=list)

    def add(self, said: Said) -> None:
        other = next((o for o in self.said if {o.decision, said.decision} == _OPPOSITE), None)
        if other is not None:
            self.errors.append(
                said.row.error(
                    f"it says {said.decision}, and {other.row.file.name}, {other.row.place} says "
                    f"{other.decision} of the same {self.what}",
                    "Delete one of the two rows",
                )
            )
        self.said.append(said)

    @property
    def decision(self) -> Decided:
        words: set[Decision] = {said.decision for said in self.said}
        return "rejected" if "reject" in words else "accepted" if "accept" in words else _OPEN

    @property
    def texts(self) -> tuple[str, str]:
        """The comments and the reviewers, each once."""
        comments = dict.fromkeys(each.comment for each in self.said if each.comment)
        people = dict.fromkeys(each.reviewer for each in self.said if each.reviewer)
        return " | ".join(comments), " | ".join(people)


_OPPOSITE = {"accept", "reject"}
_OPEN: Decided = "not reviewed"
