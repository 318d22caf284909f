"""The cover of the ground: grass and scrub, roads, railways, water."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.synthetic.scene.random_fields import Raster, field_seed, value_noise
from scenenet.synthetic.settings import SyntheticSettings

STEP_M = 0.5
"""Side of a cell of the cover, m."""

MEADOW_M, TALLNESS_M = 30.0, 18.0
"""Extent of meadows, and of places where their grass is tall, m."""

WAY_M = 230.0
"""Extent of the land between two roads or railways, m."""

ROAD_HALF_WIDTH_M, BED_HALF_WIDTH_M = 2.2, 2.0
BED_HEIGHT_M, RAIL_HEIGHT_M, RAIL_M = 0.4, 0.17, 0.75
"""Height of the ballast bed of a railway, of its rails above the bed, and their distance from its
middle, m."""

AROUND_TOWER_M = 2.6
"""Grass is not mown within this distance of a tower, m."""

WATER_M = 300.0
"""Extent of rivers and ponds, m."""


@dataclass(frozen=True)
class Cover:
    """Rasters over a stretch.

    Attributes:
        grass: share of the returns near the ground that come from low vegetation.
        tallness: mean height of low vegetation, m.
        rise: height of the bare surface above the ground (ballast and rails), m.
        water: 1 on water, else 0.
    """

    grass: Raster
    tallness: Raster
    rise: Raster
    water: Raster


class GroundCover:
    """The cover of the ground at any place; it does not depend on the stretch."""

    def __init__(self, settings: SyntheticSettings) -> None:
        self._settings = settings
        self._seed = settings.seed
        x, y = np.random.default_rng(0).uniform(0, 20_000, (2, 20_000))
        # The share of a field above a threshold is estimated from a sample of it.
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
            woods: height of the canopy above the ground, m; scrub is denser below it.
            feet: x and y of nearby towers, m, and the share of low vegetation around each.
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
        # Roads and railways follow the zeros of a slowly varying field; the field divided by its
        # slope is the distance to them.
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
