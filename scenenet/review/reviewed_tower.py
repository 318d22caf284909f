"""A tower as a review leaves it: what was found, and what people say about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from scenenet.detection.survey_tower import CONTRIBUTION

Decided = Literal["accepted", "rejected", "added", "not reviewed"]

REVIEW_COLUMNS: dict[str, type] = {"decision": str, "comment": str, "reviewer": str}
"""Columns that a review adds to a tower list, with the types of their values."""


@dataclass(frozen=True)
class ReviewedTower:
    """A tower that was found or added.

    Attributes:
        id: its number; that of an added tower follows from its place as well.
        x, y: in the CRS and the units of the survey.
        base: elevation of its foot; None if it is not known.
        values: column of the tower list -> its value; None for what is not known.
        decision: what people decided.
        comment: what they wrote; several comments are separated by `` | ``.
        reviewer: who decided or wrote, in the same way.
    """

    id: int
    x: float
    y: float
    base: float | None
    values: Mapping[str, Any]
    decision: Decided
    comment: str = ""
    reviewer: str = ""

    def to_row(self) -> dict[str, Any]:
        """Its values by column, those of the review last."""
        said = {"decision": self.decision, "comment": self.comment, "reviewer": self.reviewer}
        return {**self.values, **said}

    def to_feature(self, coordinates: Sequence[float]) -> dict[str, Any]:
        """The tower as a GeoJSON feature at ``coordinates``, with the properties that a predicted
        tower has."""
        row = self.to_row()
        shares = {n.removeprefix(CONTRIBUTION): v for n, v in row.items() if _is_share(n)}
        properties = {name: value for name, value in row.items() if not _is_share(name)}
        if properties.get("conductor_bearings") is not None:
            bearings = str(properties["conductor_bearings"]).split()
            properties["conductor_bearings"] = [float(bearing) for bearing in bearings]
        properties["contributions"] = {n: v for n, v in shares.items() if v is not None}
        return {
            "type": "Feature",
            "id": self.id,
            "geometry": {"type": "Point", "coordinates": list(coordinates)},
            "properties": properties,
        }


def _is_share(column: str) -> bool:
    return column.startswith(CONTRIBUTION)
