"""What the ground is covered with: grass and scrub, roads, railways, water."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.synthetic.scene.random_fields import Raster, field_seed, value_noise
from scenenet.synthetic.settings import SyntheticSettings

STEP_M = 0.5
"""Cell of the cover."""

MEADOW_M, TALLNESS_M = 30.0, 18.0
"""Extent of meadows and of places where they are tall."""

WAY_M = 230.0
"""Extent of the land between two ways."""

ROAD_HALF_WIDTH_M, BED_HALF_WIDTH_M = 2.2, 2.0
BED_HEIGHT_M, RAIL_HEIGHT_M, RAIL_M = 0.4, 0.17, 0.75
"""Ballast bed of a railway, and its rails above it, so far from its middle."""

AROUND_TOWER_M = 2.6
"""Nobody mows so near to a tower."""

WATER_M = 300.0
"""Extent of rivers and ponds."""


@dataclass(frozen=True)
class Cover:
    """Rasters over a stretch.

    Attributes:
        grass: share of the returns near the ground that low vegetation gives.
        tallness: how tall that is, m: its mean.
        rise: of the bare surface above the ground, m: ballast and rails.
        water: 1 on water.
    """

    grass: Raster
    tallness: Raster
    rise: Raster
    water: Raster


class GroundCover:
    """The cover of the ground at any place, the same from whichever stretch one asks."""

    def __init__(self, settings: SyntheticSettings) -> None:
        self._settings = settings
        self._seed = settings.seed
        x, y = np.random.default_rng(0).uniform(0, 20_000, (2, 20_000))
        # The share of a field above a threshold is only known from a sample of it.
        self._wet = np.quantile(self._field(x, y, "water", WATER_M), 1 - settings.water)
        kind = self._field(x, y, "way kind", 2 * WAY_M)
        self._road = np.quantile(kind, settings.roads)
        self._rail = np.quantile(kind, 1 - settings.rails)

    def _field(self, x: np.ndarray, y: np.ndarray, name: str, wavelength: float) -> np.ndarray:
        return value_noise(x, y, wavelength, field_seed(self._seed, name))

    def within(
        self,
        bounds: tuple[float, float, float, float],
        woods: Raster,
        feet: Sequence[tuple[float, float, float]] = (),
    ) -> Cover:
        """The cover within ``bounds`` (m).

        Args:
            woods: height of what grows above the ground; below it scrub is thicker.
            feet: x and y of towers near by, m, and the share of low vegetation around them.
        """
        settings = self._settings
        grass, tallness, rise, water = (Raster.covering(bounds, STEP_M) for _ in range(4))
        x, y = grass.nodes()
        meadow = self._field(x, y, "meadow", MEADOW_M)
        meadow = meadow + 0.6 * self._field(x, y, "meadow detail", MEADOW_M / 4)
        grown = np.clip(settings.low_vegetation * (1 + 1.5 * meadow), 0, 0.97)
        below = woods.values.ravel()[woods.nearest(x.ravel(), y.ravel())].reshape(x.shape) > 2.0
        grown = np.where(below, np.clip(1.6 * grown + 0.2, 0, 0.85), grown)
        for foot_x, foot_y, share in feet:
            around = np.hypot(x - foot_x, y - foot_y) < AROUND_TOWER_M
            grown = np.where(around, np.maximum(grown, share), grown)
        tall = np.clip(0.5 + 0.6 * self._field(x, y, "tallness", TALLNESS_M), 0, 1)
        mean = 0.12 + 0.8 * tall**2 + 0.35 * below
        # Ways run where a slow field changes sign; divided by its slope that gives their distance.
        way = self._field(x, y, "way", WAY_M)
        slope = np.hypot(*np.gradient(way, STEP_M))
        distance = np.abs(way) / np.maximum(slope, 1e-4)
        kind = self._field(x, y, "way kind", 2 * WAY_M)
        road = (kind < self._road) & (distance < ROAD_HALF_WIDTH_M) if settings.roads else False
        bed = (kind > self._rail) & (distance < BED_HALF_WIDTH_M) if settings.rails else False
        rail = bed & (np.abs(distance - RAIL_M) < 0.5 * STEP_M)
        grass.values[:] = np.where(road | bed, 0.05 * grown, grown)
        tallness.values[:] = mean
        rise.values[:] = BED_HEIGHT_M * bed + RAIL_HEIGHT_M * rail
        if settings.water:
            water.values[:] = self._field(x, y, "water", WATER_M) > self._wet
        return Cover(grass, tallness, rise, water)
