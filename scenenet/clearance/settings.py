"""Settings of clearances, with the limits by voltage."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from scenenet.core.errors import InputError
from scenenet.core.settings import Settings

ObstacleKind = Literal["ground", "vegetation", "building", "wire"]

GROUND, VEGETATION, BUILDING, WIRE = KINDS = ("ground", "vegetation", "building", "wire")
"""What a conductor is measured to; a wire is one of another line, or a cable."""


class ClearanceLimits(Settings):
    """Smallest distances in m that a conductor of a voltage must have.

    They are compared with distances in space. A rule that states a vertical distance is therefore
    applied in all directions.
    """

    voltage: float = Field(gt=0, description="kV, highest nominal voltage that the limits are for")
    ground: float = Field(ge=0, description="m, to the ground")
    vegetation: float = Field(ge=0, description="m, to vegetation")
    building: float = Field(ge=0, description="m, to buildings")
    wire: float = Field(ge=0, description="m, to wires of other lines")
    source: str = Field("", description="where the limits are from")

    def of(self, kind: str) -> float:
        """m, the limit for one of ``KINDS``."""
        return float(getattr(self, kind))


SOURCE = (
    "examples, to be replaced by the rules that hold for the line: ground, buildings and crossing "
    "lines after the Indian Electricity Rules 1956, vegetation after the New "
    "Zealand Electricity (Hazards from Trees) Regulations 2003, schedule (spans up to 150 m)"
)
"""Where the numbers of ``DEFAULT_LIMITS`` are from (docs/guides/clearances.md)."""

DEFAULT_LIMITS = tuple(
    ClearanceLimits(
        voltage=voltage, ground=ground, vegetation=plants, building=building, wire=wire,
        source=SOURCE,
    )
    for voltage, ground, plants, building, wire in (
        (11, 4.6, 1.6, 3.7, 2.44),
        (33, 5.2, 2.5, 3.7, 2.44),
        (66, 5.5, 4.0, 4.0, 2.44),
        (132, 6.1, 4.0, 4.6, 3.05),
        (220, 7.0, 4.0, 5.5, 4.58),
        (400, 8.8, 4.0, 7.3, 5.49),
    )
)  # fmt: skip
"""Limits that are used if the user names none."""


class SpanSag(Settings):
    """How conductors of a span hang at another temperature than that of the flight."""

    span: int = Field(ge=0, description="number of the span (span_id)")
    conductor: int | None = Field(
        None, ge=1, description="number of the wire in its span; null for all but earth wires"
    )
    c: float = Field(gt=0, description="m, catenary parameter at that temperature")
    temperature: float | None = Field(None, description="degrees Celsius; only repeated in results")
    source: str = Field("", description="where the numbers are from")


class ClearanceSettings(Settings):
    """How clearances are measured (docs/guides/clearances.md)."""

    voltage: float | None = Field(
        None, gt=0, description="kV, nominal voltage of the lines; null measures without limits"
    )
    limits: tuple[ClearanceLimits, ...] = Field(
        DEFAULT_LIMITS, min_length=1, description="limits by voltage"
    )
    sags: tuple[SpanSag, ...] = Field(
        (),
        description="spans whose clearances are those at another temperature: the same attachments "
        "with another catenary parameter; the others are as flown",
    )
    reach: float = Field(
        40.0, gt=0, le=200, description="m, planar, beside a conductor up to which is measured"
    )
    step: float = Field(5.0, gt=0, description="m, steps along a span of its profile")
    few_points: int = Field(
        5,
        ge=1,
        description="a place with fewer points that are too near is marked, and a point with fewer "
        "of its kind within about a metre is not the nearest of its kind",
    )
    tree_height: float = Field(3.0, gt=0, description="m, smallest height of a tree")
    fall_reserve: float = Field(
        0.0, ge=0, description="m that a falling tree must stay away from a conductor"
    )

    @model_validator(mode="after")
    def _ascending(self) -> ClearanceSettings:
        voltages = [row.voltage for row in self.limits]
        if voltages != sorted(set(voltages)):
            raise ValueError("limits: the voltages must ascend, each once")
        return self

    def applied(self) -> ClearanceLimits | None:
        """The limits for the voltage; None without one.

        Raises:
            InputError: the voltage is above all of the table.
        """
        if self.voltage is None:
            return None
        for row in self.limits:
            if self.voltage <= row.voltage:
                return row
        raise InputError(
            f"there are no limits for {self.voltage:g} kV: the highest voltage of the table is "
            f"{self.limits[-1].voltage:g} kV",
            remedy="Name limits for this voltage with --limits",
        )
