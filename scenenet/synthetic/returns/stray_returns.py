"""Stray returns: in the air, mostly below the helicopter, and a few below the ground."""

from __future__ import annotations

import numpy as np

from scenenet.synthetic.codes import STRAY
from scenenet.synthetic.returns.flight import Flight
from scenenet.synthetic.scene.random_fields import Raster
from scenenet.synthetic.scene.strip import Strip
from scenenet.synthetic.settings import SyntheticSettings

NEAR_FLIGHT = 0.85
"""Share of the stray returns in the air that are just below the helicopter; the rest are
anywhere."""

BELOW_FLIGHT_M = 5.0
"""Those below the helicopter are in a band below its path: scale of their distance down, and
standard deviation across, m."""
BAND_M = 3.0


def stray_points(
    strip: Strip,
    terrain: Raster,
    flight: Flight,
    settings: SyntheticSettings,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and class codes (N,) of the stray returns of one strip."""
    w = strip.half_width
    count = settings.high_strays * flight.strays * strip.area
    n = rng.poisson(NEAR_FLIGHT * count)
    s = rng.uniform(strip.first, strip.last, n)
    # Points of the band outside the corridor are mirrored into it.
    t = flight.offset + BAND_M * rng.standard_normal(n)
    t = np.where(np.abs(t) > w, np.sign(t) * (2 * w - np.abs(t)), t)
    down = 0.6 * BELOW_FLIGHT_M * rng.standard_exponential(n) + 0.08 * flight.height * np.abs(
        rng.standard_normal(n)
    )
    near_x, near_y = strip.to_map(s, t)
    # The path is straight over a stretch; it does not follow small relief.
    ends = strip.to_map(np.array([strip.low, strip.high]), np.zeros(2))
    start, end = terrain.bilinear(*ends)
    path = start + (end - start) * (s - strip.low) / (strip.high - strip.low) + flight.height
    x, y = strip.scatter((1 - NEAR_FLIGHT) * count, rng)
    up = flight.height * rng.uniform(0.3, 0.98, len(x))
    lx, ly = strip.scatter(settings.low_strays * strip.area, rng)
    depth = -0.3 - 1.5 * rng.random(len(lx))
    z = np.concatenate((path - down, terrain.bilinear(x, y) + up, terrain.bilinear(lx, ly) + depth))
    points = np.column_stack((np.concatenate((near_x, x, lx)), np.concatenate((near_y, y, ly)), z))
    points = points[strip.holds(points[:, 0], points[:, 1])]
    return points, np.full(len(points), STRAY, np.uint8)
