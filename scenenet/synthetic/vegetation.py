"""Trees and bushes: where they stand, and the canopy they make over a stretch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.synthetic.noise import Raster, field_seed, hash01, value_noise
from scenenet.synthetic.settings import SyntheticSettings

STEP_M = 0.25
"""Cell of the canopy."""

TREE_CELL_M = 4.5
BUSH_CELL_M = 2.5
"""One plant at most in a cell of this size, anywhere in it: stems keep some distance."""

STAND_M = 45.0
SCRUB_M = 25.0
"""Extent of woods and of patches of bushes."""

WIDEST_CROWN_M = 5.0


@dataclass(frozen=True)
class Plants:
    """Trees or bushes.

    Attributes:
        x, y: (P,) stem, m.
        height: (P,) m.
        radius: (P,) of the crown, m.
        bottom: (P,) height of the lowest branches, m.
        conifer: (P,) bool: a cone, not a dome.
    """

    x: np.ndarray
    y: np.ndarray
    height: np.ndarray
    radius: np.ndarray
    bottom: np.ndarray
    conifer: np.ndarray


@dataclass(frozen=True)
class Canopy:
    """Top and bottom of what grows above each cell, m above the ground; 0 where nothing does."""

    top: Raster
    bottom: Raster


class Vegetation:
    """What grows where. A plant belongs to its place, not to a stretch."""

    def __init__(self, settings: SyntheticSettings) -> None:
        self._settings = settings
        names = ("stand", "stand detail", "scrub", "tree", "bush", "texture", "stand height")
        self._seeds = {name: field_seed(settings.seed, name) for name in names}
        # The share of a field above a threshold is only known from a sample of it.
        sample = np.random.default_rng(0).uniform(0, 8000, (2, 20_000))
        self._stand_level = np.quantile(self._stand(*sample), 1 - settings.tree_cover)
        self._scrub_level = np.quantile(self._scrub(*sample), 1 - settings.bush_cover)

    def _stand(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        coarse = value_noise(x, y, STAND_M, self._seeds["stand"])
        return coarse + 0.5 * value_noise(x, y, STAND_M / 3, self._seeds["stand detail"])

    def _scrub(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return value_noise(x, y, SCRUB_M, self._seeds["scrub"])

    def trees(self, bounds: tuple[float, float, float, float]) -> Plants:
        """Trees whose stems stand within ``bounds`` (x min, y min, x max, y max; m)."""
        settings = self._settings
        x, y, draw = _candidates(bounds, TREE_CELL_M, self._seeds["tree"], 4)
        low, high = settings.tree_height
        # Trees of one stand are of one age.
        age = 0.5 + 0.5 * value_noise(x, y, 2 * STAND_M, self._seeds["stand height"])
        height = low + (high - low) * np.clip(0.15 + 0.7 * age + 0.4 * (draw[1] - 0.5), 0, 1)
        conifer = draw[2] < settings.conifers
        radius = np.where(conifer, 0.14, 0.24) * height * (0.7 + 0.6 * draw[3]) + 0.6
        bottom = np.where(conifer, 0.2, 0.35) * height * (0.5 + draw[0])
        keep = self._stand(x, y) > self._stand_level
        radius = np.minimum(radius, WIDEST_CROWN_M)
        return _select(keep, x, y, height, radius, bottom, conifer)

    def bushes(self, bounds: tuple[float, float, float, float]) -> Plants:
        """Bushes that stand within ``bounds``."""
        x, y, draw = _candidates(bounds, BUSH_CELL_M, self._seeds["bush"], 2)
        height = 0.6 + 2.8 * draw[0] ** 2
        radius = 0.6 + 1.2 * draw[1]
        keep = self._scrub(x, y) > self._scrub_level
        nothing = np.zeros(len(x))
        return _select(keep, x, y, height, radius, nothing, nothing.astype(bool))

    def canopy(self, bounds: tuple[float, float, float, float], trees: Plants) -> Canopy:
        """The canopy over ``bounds``: of ``trees``, and of the bushes there."""
        top = Raster.covering(bounds, STEP_M)
        bottom = Raster.covering(bounds, STEP_M)
        x, y = top.nodes()
        # Branches: without them crowns would be bodies of revolution.
        texture = np.ones_like(top.values)
        for wavelength, share in ((2.2, 0.22), (0.8, 0.14)):
            texture += share * value_noise(x, y, wavelength, self._seeds["texture"])
        for plants in (self.bushes(bounds), trees):
            _paint(top, bottom, plants, texture)
        return Canopy(top, bottom)


def _candidates(
    bounds: tuple[float, float, float, float], cell: float, seed: int, draws: int
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """One place in each cell that meets ``bounds``, and ``draws`` random numbers for each place."""
    i = np.arange(int(np.floor(bounds[0] / cell)), int(np.ceil(bounds[2] / cell)))
    j = np.arange(int(np.floor(bounds[1] / cell)), int(np.ceil(bounds[3] / cell)))
    i, j = (grid.ravel() for grid in np.meshgrid(i, j))
    random = [hash01(i, j, seed + k) for k in range(draws + 2)]
    return (i + random[0]) * cell, (j + random[1]) * cell, random[2:]


def _select(keep: np.ndarray, *columns: np.ndarray) -> Plants:
    return Plants(*(column[keep] for column in columns))


def keep_clear(plants: Plants, distance: np.ndarray, clearing: float) -> Plants:
    """The plants that stand at least ``clearing`` metres from the line."""
    return _select(
        distance >= clearing,
        plants.x,
        plants.y,
        plants.height,
        plants.radius,
        plants.bottom,
        plants.conifer,
    )


def _paint(top: Raster, bottom: Raster, plants: Plants, texture: np.ndarray) -> None:
    """Raise the canopy where a plant is higher than what is there already."""
    rows, columns = top.values.shape
    for x, y, height, radius, low, conifer in zip(
        plants.x, plants.y, plants.height, plants.radius, plants.bottom, plants.conifer, strict=True
    ):
        c0 = max(int(np.ceil((x - radius) / STEP_M)) - top.i, 0)
        c1 = min(int(np.floor((x + radius) / STEP_M)) - top.i + 1, columns)
        r0 = max(int(np.ceil((y - radius) / STEP_M)) - top.j, 0)
        r1 = min(int(np.floor((y + radius) / STEP_M)) - top.j + 1, rows)
        if c0 >= c1 or r0 >= r1:
            continue
        window = slice(r0, r1), slice(c0, c1)
        dx = (np.arange(c0, c1) + top.i) * STEP_M - x
        dy = (np.arange(r0, r1) + top.j) * STEP_M - y
        share = (dx * dx + (dy * dy)[:, None]) / (radius * radius) * texture[window]
        depth = height - low
        if conifer:
            crown = low + depth * (1 - np.sqrt(share))
            under = np.full_like(crown, low)
        else:
            dome = np.sqrt(np.maximum(1 - share, 0))
            crown = low + depth * (0.4 + 0.6 * dome)
            under = low + 0.4 * depth * (1 - dome)
        higher = (share < 1) & (crown > top.values[window])
        top.values[window][higher] = crown[higher]
        bottom.values[window][higher] = under[higher]
