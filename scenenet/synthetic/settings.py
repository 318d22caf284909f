"""Settings of one synthetic survey."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenenet.core.settings import Settings

Kind = Literal["lattice", "lattice_pole", "tubular", "wooden", "h_frame", "window"]
Obstacle = Literal["mast", "street_light", "house", "dead_tree", "crane", "fence"]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Weight = Annotated[float, Field(ge=0.0)]
Metres = Annotated[float, Field(gt=0.0)]

SHORTEST_SHARE = 0.55
"""Spans may shrink to this share of their random length to keep conductors clear of the ground."""


class SyntheticSettings(Settings):
    """One corridor survey (thesis section 5.1): its scene and how it is scanned.

    The defaults make a medium-voltage line of poles like those of the public TS40K crops. For a
    line of transmission pylons as in thesis 5.1.2 use the settings in docs/method/synthetic.md.
    """

    towers: int = Field(14, ge=1, le=1_000_000, description="number of towers of the line")
    seed: int = Field(
        0, ge=0, description="seed of the survey; the same settings give the same points"
    )

    kinds: dict[Kind, Weight] = Field(
        default={
            "lattice_pole": 0.5,
            "tubular": 0.34,
            "wooden": 0.08,
            "h_frame": 0.04,
            "lattice": 0.04,
        },
        description="weight of each kind of tower in the line",
    )
    height: tuple[Metres, Metres] = Field(
        (14.5, 20.0), description="least and greatest height of a tower above its foot, m"
    )
    height_mean: float | None = Field(
        None,
        gt=0,
        description="mean height of the towers, m, with more of them near the further limit of "
        "height; none: all heights between the limits are equally likely",
    )
    body_width: float | None = Field(
        None,
        gt=0,
        le=20.0,
        description="width of the body of every tower, the same from foot to head, m: side of a "
        "lattice, diameter of a pole, distance between the poles of an H-frame; none: that of its "
        "kind",
    )
    arm_reach: float | None = Field(
        None,
        gt=0,
        le=30.0,
        description="reach of the longest cross-arm from the axis of every tower, m; none: that of "
        "its kind",
    )
    span: float = Field(70.0, ge=30.0, le=800.0, description="mean distance between towers, m")
    span_spread: float = Field(
        8.0, ge=0.0, description="standard deviation of the distance between towers, m"
    )
    span_limits: tuple[Metres, Metres] | None = Field(
        None,
        description="least and greatest distance between towers, m; distances are then skewed "
        "between them around span, without span_spread; none: normally distributed",
    )
    circuits: Literal[1, 2] = Field(1, description="circuits of three conductors each")
    earth_wires: Literal[0, 1, 2] = Field(0, description="earth wires at the tower tops")
    bundle: Literal[1, 2, 3, 4] = Field(
        1, description="subconductors of a conductor, 0.4 m apart; earth wires are single"
    )
    catenary: float = Field(
        900.0,
        ge=100.0,
        le=5000.0,
        description="catenary parameter (tension over weight per metre), m; sag = span^2 / (8 c)",
    )
    bend: float = Field(
        30.0, ge=0.0, le=90.0, description="largest change of direction of the line, degrees"
    )
    bend_share: Share = Field(
        0.2, description="share of the towers at which the line changes direction"
    )
    tension: Share = Field(
        0.0,
        description="share of the towers on straight stretches that end their conductors at tension"
        " strings, with jumpers around the tower; with a share above 0 all towers at bends do",
    )
    other_lines: float = Field(
        14.0,
        ge=0.0,
        le=100.0,
        description="cables of other lines in the corridor, per km of line",
    )

    half_width: float = Field(
        12.6, ge=5.0, le=200.0, description="half the width of the corridor, m"
    )
    section: int = Field(
        4,
        ge=0,
        description="mean number of towers between two gaps in the survey, which start and end at a"
        " tower as in the files of TS40K; 0 for no gaps; 1 for surroundings of single towers, the "
        "points within margin of each tower",
    )
    margin: float = Field(
        0.5,
        ge=0.1,
        le=200.0,
        description="length of corridor beyond the last tower before a gap, m; for section 1 the "
        "radius around a tower",
    )

    elevation: float = Field(250.0, description="mean elevation of the ground, m")
    relief: float = Field(170.0, ge=0.0, le=500.0, description="height of hills above valleys, m")
    roughness: float = Field(
        0.5,
        ge=0.0,
        le=1.0,
        description="share of the relief repeated at half the wavelength (0 smooth, 1 rough)",
    )
    terraces: Share = Field(0.12, description="share of the ground with terraces")

    tree_cover: Share = Field(0.64, description="share of the ground that is wooded")
    conifers: Share = Field(0.4, description="share of conifers among the trees")
    tree_height: tuple[Metres, Metres] = Field((2.5, 25.0), description="height of trees, m")
    bush_cover: Share = Field(0.35, description="share of the ground with bushes")
    hedges: Share = Field(0.3, description="share of field borders that have a hedge")
    low_vegetation: Share = Field(
        0.2, description="share of the returns near open ground that come from grass and scrub"
    )
    penetration: Share = Field(
        0.05,
        description="share of the pulses that pass through 5 m of foliage; gaps between branches"
        " let more through",
    )
    clearing: float = Field(
        1.3, ge=0.0, description="distance from the line to which crowns are cut back, m"
    )
    lower_ground: Share = Field(
        0.26, description="share of the returns from bare ground, the lower ones, with class 19"
    )
    key_points: Share = Field(
        0.12,
        description="share of the returns from the ground and from grass that may be key points "
        "(classes 2 and 3), at most one per m^2; half of it for scrub (class 4)",
    )
    water: Share = Field(0.0, description="share of the ground that is water (class 9)")
    roads: Share = Field(0.5, description="share of the linear ways that are roads")
    rails: Share = Field(0.1, description="share of the linear ways that are railways")

    density: float = Field(
        74.0,
        ge=1.0,
        le=500.0,
        description="pulses per m^2 of ground; in crowns a pulse may return several points",
    )
    swath_overlap: Share = Field(0.08, description="share of the corridor that is scanned twice")
    flight_height: tuple[Metres, Metres] = Field(
        (38.0, 80.0),
        description="least and greatest height of the flight above the ground, m; decides what is"
        " hidden behind objects, and most stray returns are just below it",
    )
    tower_density: float = Field(
        10.5, ge=1.0, le=500.0, description="points per m^2 of surface of tower members"
    )
    wire_returns: Share = Field(
        0.75, description="share of the scan lines that give a point on a conductor"
    )
    ranging_noise: float = Field(
        0.025, ge=0.0, le=0.5, description="standard deviation of a point's position, m"
    )

    high_strays: float = Field(
        0.2, ge=0.0, le=10.0, description="stray returns in the air per m^2 of ground"
    )
    low_strays: float = Field(
        0.002, ge=0.0, le=10.0, description="stray returns below the ground per m^2 of ground"
    )
    clutter: float = Field(
        14.0,
        ge=0.0,
        le=200.0,
        description="objects that resemble a tower, houses and fences, per km of line",
    )
    clutter_kinds: dict[Obstacle, Weight] = Field(
        default={
            "mast": 0.2,
            "street_light": 0.15,
            "house": 0.35,
            "dead_tree": 0.12,
            "crane": 0.03,
            "fence": 0.15,
        },
        description="weight of each kind of object",
    )

    annotation_noise: Share = Field(
        0.5,
        description="how much of the surroundings of a tower is labelled tower: 0 labels equal the"
        " truth, 0.5 as in TS40K, 1 most",
    )

    easting: float = Field(545_000.0, description="easting of the start of the line, m")
    northing: float = Field(4_634_000.0, description="northing of the start of the line, m")
    epsg: int = Field(32629, description="EPSG code of the (projected, metric) CRS")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for name in ("height", "tree_height", "flight_height", "span_limits"):
            low, high = getattr(self, name) or (0, 0)
            if low > high:
                raise ValueError(
                    f"{name}: the lower limit ({low}) is above the upper limit ({high})"
                )
        _require_between("height_mean", self.height_mean, "height", self.height)
        _require_between("span", self.span, "span_limits", self.span_limits)
        for name in ("kinds", "clutter_kinds"):
            if not sum(getattr(self, name).values()) > 0:
                raise ValueError(f"{name}: at least one kind needs a weight above 0")
        if self.body_width and self.arm_reach and 2 * self.arm_reach <= self.body_width:
            raise ValueError(
                f"arm_reach: cross-arms that reach {self.arm_reach:g} m do not leave a body "
                f"{self.body_width:g} m wide"
            )
        if self.roads + self.rails > 1:
            raise ValueError("roads and rails: their sum is above 1")
        shortest = (
            SHORTEST_SHARE * (self.span - 2 * self.span_spread)
            if self.span_limits is None
            else self.span_limits[0]
        )
        if shortest < 2 * self.half_width * math.tan(math.radians(self.bend) / 2) or shortest < 10:
            raise ValueError(
                f"span: the shortest possible span ({shortest:.0f} m) is too short for a corridor"
                f" {2 * self.half_width:g} m wide that turns by {self.bend:g} degrees"
            )
        if self.section and 2 * self.margin > shortest:
            raise ValueError(
                f"margin: {self.margin:g} m on both sides of a gap leave no gap in a span of"
                f" {shortest:.0f} m"
            )
        return self


def _require_between(
    name: str, mean: float | None, of: str, limits: tuple[float, float] | None
) -> None:
    """Refuse a mean that no distribution between the limits has."""
    if mean is not None and limits is not None and not limits[0] < mean < limits[1]:
        raise ValueError(
            f"{name}: a mean of {mean:g} is not between the limits of {of}, {limits[0]:g} and "
            f"{limits[1]:g}"
        )
