"""What a scanner that looks down gets back from ground and vegetation, and its class codes.

The codes follow what the public TS40K crops show when heights above the ground are compared by
class: apart from thinned key points (2, 3, 4, 5) the returns of the ground stand in 10 and 19,
those of low vegetation up to about 2 m in 11 and those of taller vegetation in 12. That, and not
rails and roads, is what makes classes 10, 11 and 12 the bulk of thesis Table 5.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.synthetic.line import Strip
from scenenet.synthetic.noise import Raster, field_seed, value_noise
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.synthetic.vegetation import Canopy

UNCLASSIFIED, GROUND, LOW_VEGETATION, MEDIUM_VEGETATION, TREE, NOISE = 1, 2, 3, 4, 5, 7
RAIL, ROAD, OVERLAP, TOWER, WIRE, OTHER = 10, 11, 12, 15, 16, 19

TALL_M = 2.0
"""Vegetation above this height is tall."""

GRASS_M = 0.3
"""Vegetation below this height has its key points in class 3, above it in class 4."""

KEY_POINTS = 1.2
"""Key points of the ground per m^2, whatever the density."""

FIELD_STEP_M = 2.0

ROAD_HALF_WIDTH_M = 2.2


@dataclass(frozen=True)
class Ground:
    """What the ground of a stretch is covered with: rasters of shares in [0, 1].

    Attributes:
        grass: returns near the ground that low vegetation gives.
        tallness: how tall that vegetation is.
        other: returns of the ground in class 19.
        road: 1 on a road.
    """

    grass: Raster
    tallness: Raster
    other: Raster
    road: Raster


def ground_cover(settings: SyntheticSettings, bounds: tuple[float, float, float, float]) -> Ground:
    """The cover of the ground within ``bounds`` (m), the same from whichever stretch one asks."""
    rasters = [Raster.covering(bounds, FIELD_STEP_M) for _ in range(4)]
    x, y = rasters[0].nodes()

    def field(name: str, wavelength: float) -> np.ndarray:
        return value_noise(x, y, wavelength, field_seed(settings.seed, name))

    meadow = field("meadow", 30.0) + 0.6 * field("meadow detail", 7.0)
    # Roads run where a slow field changes sign; divided by its slope that gives their distance.
    way = field("road", 220.0)
    slope = np.hypot(*np.gradient(way, FIELD_STEP_M))
    road = np.abs(way) < ROAD_HALF_WIDTH_M * np.maximum(slope, 1e-4)
    grass = np.clip(settings.low_vegetation * (1 + 1.3 * meadow), 0, 0.95)
    rasters[0].values[:] = np.where(road, 0.02 * grass, grass)
    rasters[1].values[:] = np.clip(0.5 + 0.6 * field("tallness", 18.0), 0, 1)
    rasters[2].values[:] = np.clip(0.18 + 0.2 * field("other", 25.0), 0, 1)
    rasters[3].values[:] = road
    return Ground(*rasters)


def scan_surface(
    strip: Strip,
    terrain: Raster,
    canopy: Canopy,
    solid: Raster,
    settings: SyntheticSettings,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and codes (N,) of ground, vegetation and roofs in one stretch.

    ``density`` pulses fall on each m^2. A pulse on a crown returns from its upper side, often from
    within, and with the share ``penetration`` from the ground or the low vegetation below.

    Args:
        terrain: elevation of the ground, m.
        canopy: what grows there.
        solid: height of roofs above the ground, m; 0 where there is none.
    """
    x, y = strip.scatter(round(strip.area * settings.density), rng)
    ground = terrain.bilinear(x, y)
    cell = canopy.top.nearest(x, y)
    top, bottom = canopy.top.values.ravel()[cell], canopy.bottom.values.ravel()[cell]
    roof = solid.values.ravel()[solid.nearest(x, y)]
    covered = np.flatnonzero((top > 0) & (roof == 0))
    crown, height, crown_code = _crown_returns(covered, top, bottom, rng)
    reaches = roof == 0
    reaches[covered] = rng.random(len(covered)) < settings.penetration
    below = np.flatnonzero(reaches)
    low, low_code = _low_returns(strip, x[below], y[below], settings, rng)
    roofs = np.flatnonzero(roof)
    which = np.concatenate((below, crown, roofs))
    above = np.concatenate((low, height, roof[roofs]))
    z = ground[which] + above + settings.ranging_noise * rng.standard_normal(len(which))
    code = np.concatenate((low_code, crown_code, np.full(len(roofs), UNCLASSIFIED, np.uint8)))
    return np.column_stack((x[which], y[which], z)), code


def _low_returns(
    strip: Strip,
    x: np.ndarray,
    y: np.ndarray,
    settings: SyntheticSettings,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Height above the ground (N,) and code (N,) of pulses that get near the ground."""
    cover = ground_cover(settings, strip.bounds())
    at = cover.grass.nearest(x, y)
    height = np.zeros(len(x))
    draw = rng.random(len(x))
    code = np.where(draw < cover.other.values.ravel()[at], np.uint8(OTHER), np.uint8(RAIL))
    code[draw > 1 - KEY_POINTS / max(settings.density, 2 * KEY_POINTS)] = GROUND
    code[(cover.road.values.ravel()[at] > 0) & (code == RAIL)] = ROAD
    grown = np.flatnonzero(rng.random(len(x)) < cover.grass.values.ravel()[at])
    # Mostly grass, in places scrub of a metre or more.
    scale = 0.08 + 0.9 * cover.tallness.values.ravel()[at[grown]] ** 3
    tall = scale * rng.standard_exponential(len(grown))
    over = np.flatnonzero(tall >= TALL_M)
    tall[over] = TALL_M * rng.random(len(over))
    height[grown] = tall
    code[grown] = _vegetation_codes(tall, rng)
    return height, code


def _crown_returns(
    covered: np.ndarray, top: np.ndarray, bottom: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pulse (R,), height above the ground (R,) and code (R,) of the returns from crowns."""
    top, bottom = top[covered], bottom[covered]
    depth = top - bottom
    n = len(covered)
    first = rng.random(n) < 0.92
    # Deep crowns return more than once, bushes hardly ever.
    more = rng.random(n) < 0.8 * depth / (depth + 2.0)
    third = more & (rng.random(n) < 0.35)
    outer = top[first] - np.minimum(
        rng.standard_exponential(int(first.sum())) * (0.15 + 0.12 * depth[first]), depth[first]
    )
    inner = [bottom[m] + depth[m] * rng.random(int(m.sum())) for m in (more, third)]
    which = np.concatenate((covered[first], covered[more], covered[third]))
    height = np.concatenate((outer, *inner))
    # A few returns come from the stem and from dead branches below the crown.
    stem = rng.random(len(height)) < 0.04
    height[stem] *= rng.random(int(stem.sum()))
    return which, height, _vegetation_codes(height, rng)


def _vegetation_codes(height: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Codes (N,) of returns from vegetation at ``height`` (N,) m above the ground."""
    draw = rng.random(len(height))
    key_point = np.where(height < GRASS_M, np.uint8(LOW_VEGETATION), np.uint8(MEDIUM_VEGETATION))
    low = np.where(draw < 0.03, key_point, np.uint8(ROAD))
    tall = np.full(len(height), OVERLAP, np.uint8)
    tall[draw < 0.07] = TREE
    tall[draw < 0.02] = NOISE
    tall[draw < 0.008] = UNCLASSIFIED
    return np.where(height < TALL_M, low, tall)
