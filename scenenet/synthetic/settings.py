"""Settings of one synthetic survey."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenenet.settings import Settings

Kind = Literal["lattice", "lattice_pole", "tubular", "wooden", "h_frame"]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Weight = Annotated[float, Field(ge=0.0)]
Metres = Annotated[float, Field(gt=0.0)]

SHORTEST_SHARE = 0.55
"""Towers may stand this much nearer than drawn, where the ground asks for it."""


class SyntheticSettings(Settings):
    """One corridor survey (thesis section 5.1): what stands in it and how it is scanned.

    The defaults make a medium-voltage line of poles like those of the public TS40K crops; a line of
    transmission pylons as thesis 5.1.2 tells it takes ``kinds={"lattice": 1}``, ``span=300``,
    ``height=(25, 40)`` and ``half_width=40``.
    """

    towers: int = Field(14, ge=1, le=1_000_000, description="number of towers of the line")
    seed: int = Field(0, ge=0, description="seed; the same settings give the same points")

    kinds: dict[Kind, Weight] = Field(
        default={
            "tubular": 0.35,
            "lattice_pole": 0.3,
            "wooden": 0.1,
            "h_frame": 0.1,
            "lattice": 0.15,
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
    earth_wires: Literal[0, 1] = Field(0, description="earth wires at the tower tops")
    catenary: float = Field(
        900.0,
        ge=100.0,
        le=5000.0,
        description="catenary parameter (tension over weight per metre), m; sag = span^2 / (8 c)",
    )
    bend: float = Field(30.0, ge=0.0, le=60.0, description="largest turn of the line, degrees")
    bend_share: Share = Field(0.2, description="share of the towers at which the line turns")

    half_width: float = Field(
        20.0, ge=5.0, le=200.0, description="half the width of the corridor, m"
    )
    margin: float = Field(
        20.0, ge=1.0, le=200.0, description="corridor beyond the first and last tower, m"
    )

    elevation: float = Field(250.0, description="mean elevation of the ground, m")
    relief: float = Field(
        120.0, ge=0.0, le=500.0, description="height between valleys and hills, m"
    )
    roughness: float = Field(
        0.5,
        ge=0.0,
        le=1.0,
        description="how much of the relief returns at half the wavelength (0 smooth, 1 broken)",
    )

    tree_cover: Share = Field(0.3, description="share of the ground that is wooded")
    conifers: Share = Field(0.4, description="share of conifers among the trees")
    tree_height: tuple[Metres, Metres] = Field((5.0, 20.0), description="height of trees, m")
    bush_cover: Share = Field(0.2, description="share of the ground with bushes")
    low_vegetation: Share = Field(
        0.3, description="share of the returns near the ground that grass and scrub give"
    )
    penetration: Share = Field(
        0.3, description="share of the pulses on a crown that also return from below it"
    )
    clearing: float = Field(
        3.0, ge=0.0, description="no tree stands nearer to the line than this, m"
    )

    density: float = Field(
        54.0, ge=1.0, le=500.0, description="pulses per m^2 of ground; crowns return more than one"
    )
    tower_density: float = Field(
        24.0, ge=1.0, le=500.0, description="points per m^2 of surface of tower members"
    )
    wire_density: float = Field(5.0, ge=0.1, le=100.0, description="points per m of a conductor")
    ranging_noise: float = Field(
        0.03, ge=0.0, le=0.5, description="standard deviation of a point's position, m"
    )

    high_strays: float = Field(
        0.08, ge=0.0, le=10.0, description="stray returns in the air per m^2 of ground"
    )
    low_strays: float = Field(
        0.004, ge=0.0, le=10.0, description="stray returns below the ground per m^2 of ground"
    )
    stray_height: float = Field(
        55.0, ge=1.0, le=500.0, description="highest stray return, m above the ground"
    )
    clutter: float = Field(
        12.0,
        ge=0.0,
        le=200.0,
        description="things that could pass for a tower (lone masts, street lights) and houses,"
        " per km of line",
    )

    annotation_noise: Share = Field(
        0.5,
        description="how generously annotators labelled the surroundings of a tower as tower;"
        " 0 labels equal the truth, 0.5 about half of the tower labels are wrong as in TS40K",
    )

    easting: float = Field(545_000.0, description="easting of the start of the line, m")
    northing: float = Field(4_634_000.0, description="northing of the start of the line, m")
    epsg: int = Field(32629, description="EPSG code of the (projected, metric) CRS")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for name in ("height", "tree_height"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"{name}: the lowest ({low}) is above the highest ({high})")
        if not sum(self.kinds.values()) > 0:
            raise ValueError("kinds: at least one kind of tower needs a weight above 0")
        shortest = SHORTEST_SHARE * (self.span - 2 * self.span_spread)
        if shortest < 2 * self.half_width * math.tan(math.radians(self.bend) / 2) or shortest < 10:
            raise ValueError(
                f"span: the shortest spans ({shortest:.0f} m) are too short for a corridor of"
                f" {2 * self.half_width:g} m that turns by {self.bend:g} degrees"
            )
        return self
