"""Stray returns, and things that stand about and could pass for a tower."""

from __future__ import annotations

import numpy as np

from scenenet.synthetic.line import Strip
from scenenet.synthetic.noise import Raster
from scenenet.synthetic.scan import NOISE, UNCLASSIFIED
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.synthetic.structures import place, sample

CLOUD_POINTS = 40
"""Stray returns of one cloud: they come in swarms as well as alone."""

CLOUD_SHARE = 0.7
"""Share of the strays in the air that come in swarms."""

HOUSE_STEP_M = 0.5


def strays(
    strip: Strip, terrain: Raster, settings: SyntheticSettings, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and codes (N,) of stray returns in the air and below the ground."""
    n_high = settings.high_strays * strip.area
    x, y = strip.scatter(round(n_high * (1 - CLOUD_SHARE)), rng)
    up = settings.stray_height * (0.1 + 0.9 * rng.random(len(x)))
    # Swarms sit high up, some metres wide.
    cx, cy = strip.scatter(max(1, round(n_high * CLOUD_SHARE / CLOUD_POINTS)), rng)
    if settings.high_strays == 0:
        cx, cy = cx[:0], cy[:0]
    cloud = np.repeat(np.arange(len(cx)), rng.poisson(CLOUD_POINTS, len(cx)))
    centre_up = settings.stray_height * (0.5 + 0.5 * rng.random(len(cx)))
    spread = rng.standard_normal((3, len(cloud)))
    sx, sy = cx[cloud] + 4.0 * spread[0], cy[cloud] + 4.0 * spread[1]
    s_up = np.clip(centre_up[cloud] + 3.0 * spread[2], 3.0, settings.stray_height)
    inside = strip.holds(sx, sy)
    lx, ly = strip.scatter(round(settings.low_strays * strip.area), rng)
    down = -0.3 - 2.5 * rng.random(len(lx))
    x, y = np.concatenate((x, sx[inside], lx)), np.concatenate((y, sy[inside], ly))
    z = terrain.bilinear(x, y) + np.concatenate((up, s_up[inside], down))
    return np.column_stack((x, y, z)), np.full(len(x), NOISE, np.uint8)


def negatives(
    strip: Strip,
    terrain: Raster,
    bounds: tuple[float, float, float, float],
    settings: SyntheticSettings,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray, Raster]:
    """Masts and street lights, points (N, 3) and codes (N,), which nobody classified; and houses,
    height above the ground over ``bounds``.

    They stand beside the line, never below it, and clear of the ends of the stretch.
    """
    solid = Raster.covering(bounds, HOUSE_STEP_M)
    room = strip.high - strip.low - 24.0
    n = rng.poisson(settings.clutter * max(room, 0.0) / 1000.0)
    things = []
    for _ in range(n):
        s = strip.low + 12.0 + room * rng.random()
        t = rng.choice((-1, 1)) * strip.half_width * rng.uniform(0.35, 0.9)
        x, y = (float(v) for v in strip.to_map(s, t))
        kind = rng.choice(("mast", "light", "house"), p=(0.4, 0.35, 0.25))
        if kind == "house":
            _house(solid, x, y, strip.azimuth + rng.uniform(-0.5, 0.5), rng)
            continue
        height = rng.uniform(6.0, 14.0) if kind == "mast" else rng.uniform(5.0, 8.0)
        bars = np.array([[0, 0, 0, 0, 0, height, 0.09, 0.05]])
        if kind == "light":
            bars = np.vstack((bars, [0, 0, height, 1.6, 0, height + 0.2, 0.06, 0.1]))
        z = terrain.bilinear(np.array([x]), np.array([y]))[0]
        points = sample(bars, settings.tower_density, rng)
        things.append(place(points, x, y, z, rng.uniform(0, 2 * np.pi)))
    points = np.concatenate(things) if things else np.empty((0, 3))
    points = points[strip.holds(points[:, 0], points[:, 1])]
    return points, np.full(len(points), UNCLASSIFIED, np.uint8), solid


def _house(solid: Raster, x: float, y: float, azimuth: float, rng: np.random.Generator) -> None:
    """Put a gabled roof at (x, y)."""
    half_length, half_width = rng.uniform(3.5, 6.0), rng.uniform(2.5, 4.0)
    eaves, ridge = rng.uniform(2.5, 4.0), rng.uniform(1.0, 2.5)
    node_x, node_y = solid.nodes()
    dx, dy = node_x - x, node_y - y
    along = dx * np.cos(azimuth) + dy * np.sin(azimuth)
    across = np.abs(dy * np.cos(azimuth) - dx * np.sin(azimuth))
    inside = (np.abs(along) <= half_length) & (across <= half_width)
    solid.values[inside] = (eaves + ridge * (1 - across / half_width))[inside]
