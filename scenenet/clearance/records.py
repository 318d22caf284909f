"""What is found around the conductors of a survey, with the only declaration of the columns of its
tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from scenenet.core.columns import Record, column, columns_of
from scenenet.line.records import positions_column


@dataclass(frozen=True)
class Clearance(Record):
    """A place of a conductor and what is near it. ``CLEARANCE_COLUMNS`` says what each column
    is."""

    span_id: int = column("", "number of the span", heading="span")
    conductor_id: int = column("", "number of the conductor in its span", heading="conductor")
    conductor_kind: str = column("", "conductor or earth wire")
    what: str = column(
        "", "nearest: the nearest of its kind to this conductor; danger: a place closer than the "
        "limit", heading="what",
    )  # fmt: skip
    kind: str = column("", "ground, vegetation, building or wire", heading="kind")
    distance: float = column("m", "in space, from the conductor", heading="distance")
    vertical: float = column(
        "m", "height of the conductor above what is near", heading="vertical", vertical=True
    )
    horizontal: float = column("m", "horizontal part of the distance", heading="horizontal")
    limit: float | None = column("m", "limit for the voltage; none without a voltage")
    margin: float | None = column("m", "distance less limit; negative if too near")
    points: int = column(
        "", "points closer than the limit in this place; 0 for the nearest", heading="points"
    )
    note: str = column("", "few points, for a place with fewer than the settings say")
    along: float = column(
        "m", "horizontal distance from the start of the conductor", heading="along"
    )
    x: float = column("m", "easting of what is near")
    y: float = column("m", "northing of what is near")
    z: float = column("m", "elevation of what is near", vertical=True)
    wire_x: float = column("m", "easting of the nearest place on the conductor")
    wire_y: float = column("m", "northing of the nearest place on the conductor")
    wire_z: float = column("m", "elevation of the nearest place on the conductor", vertical=True)
    other_span: int = column("", "number of the span of a wire that is near, 0 for none")
    kinds: str = column("", "where the kinds of points are from")
    positions: str = positions_column()

    @property
    def order(self) -> float:
        """m; the worst place has the lowest."""
        return self.distance if self.margin is None else self.margin


@dataclass(frozen=True)
class FallTree(Record):
    """A tree that could fall on a conductor. ``TREE_COLUMNS`` says what each column is."""

    x: float = column("m", "easting of its top")
    y: float = column("m", "northing of its top")
    ground: float = column("m", "elevation of the ground below its top", vertical=True)
    height: float = column("m", "of its top above the ground", heading="height", vertical=True)
    distance: float = column(
        "m", "in space, from its foot to the nearest conductor", heading="distance"
    )
    margin: float = column(
        "m", "distance less height; negative if the tree could touch the conductor as it falls",
        heading="margin",
    )  # fmt: skip
    span_id: int = column("", "number of the span", heading="span")
    conductor_id: int = column("", "number of the conductor in its span", heading="conductor")
    along: float = column("m", "horizontal distance from the start of the conductor")
    kinds: str = column("", "where the kinds of points are from")
    positions: str = positions_column()


@dataclass(frozen=True)
class SpanClearance(Record):
    """A span with the worst of what is near. ``SPAN_CLEARANCE_COLUMNS`` says what each column
    is."""

    span_id: int = column("", "number of the span", heading="span")
    line: int = column("", "number of its line", heading="line")
    order: int = column("", "its place along the line, from 1", heading="order")
    from_tower: int = column("", "id of the tower at its start, 0 for none", heading="from")
    to_tower: int = column("", "id of the tower at its end, 0 for none", heading="to")
    worst_kind: str = column(
        "", "kind with the smallest margin, or without limits the smallest distance; empty if "
        "nothing is near", heading="worst",
    )  # fmt: skip
    worst_margin: float | None = column("m", "smallest margin; none without limits")
    ground: float | None = column("m", "distance of the nearest ground; none within reach: empty")
    vegetation: float | None = column("m", "distance of the nearest vegetation")
    building: float | None = column("m", "distance of the nearest building")
    wire: float | None = column("m", "distance of the nearest wire of another line, or cable")
    dangers: int = column("", "places closer than the limit", heading="dangers")
    few_points: int = column("", "of these, places with few points")
    danger_points: int = column("", "points closer than the limit")
    fall_trees: int = column("", "trees that could fall on its conductors", heading="fall trees")
    fall_margin: float | None = column("m", "smallest margin of these trees; none without one")
    kinds: str = column("", "where the kinds of points are from")
    limits: str = column("", "voltage and source of the limits; none without a voltage")
    positions: str = positions_column()


@dataclass(frozen=True)
class ProfileStep(Record):
    """What is nearest to the conductors of a span in a step along it. ``PROFILE_COLUMNS`` says what
    each column is."""

    span_id: int = column("", "number of the span", heading="span")
    start: float = column("m", "along the span from its start, where the step begins")
    kind: str = column("", "ground, vegetation or building")
    distance: float = column("m", "smallest distance in space from a conductor of the span")
    conductor_id: int = column("", "number of this conductor")
    along: float = column("m", "along the span, of the point")
    x: float = column("m", "easting of the point")
    y: float = column("m", "northing of the point")
    z: float = column("m", "elevation of the point", vertical=True)
    wire_z: float = column("m", "elevation of the nearest place on the conductor", vertical=True)
    positions: str = positions_column()


CLEARANCE_COLUMNS = columns_of(Clearance)
"""Every column of the list of clearances, in order."""

TREE_COLUMNS = columns_of(FallTree)
"""Every column of the list of trees that could fall, in order."""

SPAN_CLEARANCE_COLUMNS = columns_of(SpanClearance)
"""Every column of the table of spans, in order."""

PROFILE_COLUMNS = columns_of(ProfileStep)
"""Every column of the steps along spans, in order."""


@dataclass(frozen=True)
class SurveyClearances:
    """The clearances of a survey, each list with the worst first, but the steps in their order.

    Attributes:
        places: of every conductor the nearest of each kind, and the danger places.
        trees: that could fall on a conductor.
        spans: of lines; cables of no line are obstacles only.
        profile: steps along the spans.
        kinds: where the kinds of points are from.
        limits: voltage and source of the limits; empty without a voltage.
    """

    places: tuple[Clearance, ...]
    trees: tuple[FallTree, ...]
    spans: tuple[SpanClearance, ...]
    profile: tuple[ProfileStep, ...]
    kinds: str
    limits: str

    @property
    def dangers(self) -> tuple[Clearance, ...]:
        """The places closer than the limit."""
        return tuple(place for place in self.places if place.what == "danger")

    @property
    def positions(self) -> list[str]:
        """What the positions of the wires are that it was measured from."""
        return sorted({span.positions for span in self.spans})

    def counts(self) -> dict[str, Any]:
        """What was found, in numbers, for a summary."""
        few = sum(bool(place.note) for place in self.dangers)
        nearest: dict[str, float] = {}
        for place in self.places:
            nearest[place.kind] = min(place.distance, nearest.get(place.kind, place.distance))
        return {
            "dangers": len(self.dangers),
            "few_points": few,
            "fall_trees": len(self.trees),
            "nearest_m": nearest,
            "kinds": self.kinds,
            "limits": self.limits,
            "positions": self.positions,
        }

    def to_json(self) -> dict[str, Any]:
        return {
            "places": [place.to_json() for place in self.places],
            "trees": [tree.to_json() for tree in self.trees],
            "spans": [span.to_json() for span in self.spans],
            "profile": [step.to_json() for step in self.profile],
            "kinds": self.kinds,
            "limits": self.limits,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """What ``to_json`` gave."""
        return cls(
            places=tuple(map(Clearance.from_json, data["places"])),
            trees=tuple(map(FallTree.from_json, data["trees"])),
            spans=tuple(map(SpanClearance.from_json, data["spans"])),
            profile=tuple(map(ProfileStep.from_json, data["profile"])),
            kinds=data["kinds"],
            limits=data["limits"],
        )
