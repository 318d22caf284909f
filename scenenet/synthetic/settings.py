"""Settings of one synthetic survey."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenenet.core.settings import Settings

Kind = Literal["lattice", "lattice_pole", "tubular", "wooden", "h_frame"]
Obstacle = Literal["mast", "street_light", "house", "dead_tree", "crane", "fence"]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Weight = Annotated[float, Field(ge=0.0)]
Metres = Annotated[float, Field(gt=0.0)]

SHORTEST_SHARE = 0.55
"""Towers may stand this much nearer than drawn, where the ground asks for it."""


class SyntheticSettings(Settings):
    """One corridor survey (thesis section 5.1): what stands in it and how it is scanned.

    The defaults make a medium-voltage line of poles like those of the public TS40K crops; a line of
    transmission pylons as thesis 5.1.2 tells it takes the settings of docs/method/synthetic.md.
    """

    towers: int = Field(14, ge=1, le=1_000_000, description="number of towers of the line")
    seed: int = Field(0, ge=0, description="seed; the same settings give the same points")

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
        (14.5, 20.0), description="lowest and highest tower, m above its foot"
    )
    span: float = Field(70.0, ge=30.0, le=800.0, description="mean distance between towers, m")
    span_spread: float = Field(
        8.0, ge=0.0, description="standard deviation of the distance between towers, m"
    )
    circuits: Literal[1, 2] = Field(1, description="circuits of three conductors each")
    earth_wires: Literal[0, 1, 2] = Field(0, description="earth wires at the tower tops")
    bundle: Literal[1, 2, 3, 4] = Field(
        1, description="wires of a conductor, side by side at 0.4 m; earth wires are single"
    )
    catenary: float = Field(
        900.0,
        ge=100.0,
        le=5000.0,
        description="catenary parameter (tension over weight per metre), m; sag = span^2 / (8 c)",
    )
    bend: float = Field(30.0, ge=0.0, le=60.0, description="largest turn of the line, degrees")
    bend_share: Share = Field(0.2, description="share of the towers at which the line turns")
    other_lines: float = Field(
        14.0,
        ge=0.0,
        le=100.0,
        description="cables of other lines that cross or run along, per km of line",
    )

    half_width: float = Field(
        12.6, ge=5.0, le=200.0, description="half the width of the corridor, m"
    )
    section: int = Field(
        4,
        ge=0,
        description="mean number of towers between two gaps in the survey, which end at a tower as"
        " the files of TS40K do; 0 for none",
    )
    margin: float = Field(
        0.5, ge=0.1, le=200.0, description="corridor beyond the last tower of a section, m"
    )

    elevation: float = Field(250.0, description="mean elevation of the ground, m")
    relief: float = Field(
        170.0, ge=0.0, le=500.0, description="height between valleys and hills, m"
    )
    roughness: float = Field(
        0.5,
        ge=0.0,
        le=1.0,
        description="how much of the relief returns at half the wavelength (0 smooth, 1 broken)",
    )
    terraces: Share = Field(0.12, description="share of the ground that is cut into terraces")

    tree_cover: Share = Field(0.64, description="share of the ground that is wooded")
    conifers: Share = Field(0.4, description="share of conifers among the trees")
    tree_height: tuple[Metres, Metres] = Field((2.5, 25.0), description="height of trees, m")
    bush_cover: Share = Field(0.35, description="share of the ground with bushes")
    hedges: Share = Field(0.3, description="share of the borders of fields that have a hedge")
    low_vegetation: Share = Field(
        0.2, description="share of the returns near open ground that grass and scrub give"
    )
    penetration: Share = Field(
        0.05,
        description="share of the pulses that pass 5 m of crown; openings between the branches"
        " let more through",
    )
    clearing: float = Field(
        1.3, ge=0.0, description="crowns are cut back to this distance from the line, m"
    )
    water: Share = Field(0.0, description="share of the ground that is water (class 9)")
    roads: Share = Field(0.5, description="share of the ways that are roads")
    rails: Share = Field(0.1, description="share of the ways that are railways")

    density: float = Field(
        74.0, ge=1.0, le=500.0, description="pulses per m^2 of ground; crowns return more than one"
    )
    swath_overlap: Share = Field(
        0.08, description="share of the corridor that a second pass has scanned as well"
    )
    flight_height: tuple[Metres, Metres] = Field(
        (38.0, 80.0),
        description="lowest and highest flight above the ground, m; it is from there that things"
        " throw shadows, and below it that most stray returns are",
    )
    tower_density: float = Field(
        10.5, ge=1.0, le=500.0, description="points per m^2 of surface of tower members"
    )
    wire_returns: Share = Field(
        0.75, description="share of the scan lines that give a point on a wire"
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
        description="things that could pass for a tower, houses and fences, per km of line",
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
        description="weight of each of them",
    )

    annotation_noise: Share = Field(
        0.5,
        description="how generously annotators labelled the surroundings of a tower as tower;"
        " 0 labels equal the truth, 0.5 as in TS40K",
    )

    easting: float = Field(545_000.0, description="easting of the start of the line, m")
    northing: float = Field(4_634_000.0, description="northing of the start of the line, m")
    epsg: int = Field(32629, description="EPSG code of the (projected, metric) CRS")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for name in ("height", "tree_height", "flight_height"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"{name}: the lowest ({low}) is above the highest ({high})")
        for name in ("kinds", "clutter_kinds"):
            if not sum(getattr(self, name).values()) > 0:
                raise ValueError(f"{name}: at least one kind needs a weight above 0")
        if self.roads + self.rails > 1:
            raise ValueError("roads and rails: together they are more than all ways")
        shortest = SHORTEST_SHARE * (self.span - 2 * self.span_spread)
        if shortest < 2 * self.half_width * math.tan(math.radians(self.bend) / 2) or shortest < 10:
            raise ValueError(
                f"span: the shortest spans ({shortest:.0f} m) are too short for a corridor of"
                f" {2 * self.half_width:g} m that turns by {self.bend:g} degrees"
            )
        if self.section and 2 * self.margin > shortest:
            raise ValueError(
                f"margin: {self.margin:g} m on both sides of a gap leave none in a span of"
                f" {shortest:.0f} m"
            )
        return self
