"""Trees, bushes and hedges: their places, and the canopy over a stretch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.synthetic.scene.random_fields import Raster, field_seed, hash01, value_noise
from scenenet.synthetic.settings import SyntheticSettings

STEP_M = 0.25
"""Side of a cell of the canopy, m."""

TREE_CELL_M = 4.5
BUSH_CELL_M = 2.5
"""Side of a cell that has at most one plant, at a random place in it, so that stems keep some
distance, m."""

STAND_M = 45.0
SCRUB_M = 25.0
"""Extent of woods and of patches of bushes, m."""

WIDEST_CROWN_M = 5.0

BRANCHES = 0.7
"""Share of the radius of a crown to which trees are cut back next to the line."""

TALL_TREE_M, PER_HEIGHT = 6.0, 0.11
"""Trees above the first height (m) keep an additional distance: the second number (m) per m above
it."""

THICKET_M = 4.0
"""Extent of thickets, m."""

FIELD_M = 75.0
HEDGE_HALF_WIDTH_M = 0.9
"""Extent of the fields between hedges, and half the width of a hedge, m."""


@dataclass(frozen=True)
class Plants:
    """Trees or bushes.

    Attributes:
        x, y: (P,) stem, m.
        height: (P,) m.
        radius: (P,) of the crown, m.
        bottom: (P,) height of the lowest branches, m.
        conifer: (P,) bool: the crown is a cone, not a dome.
    """

    x: np.ndarray
    y: np.ndarray
    height: np.ndarray
    radius: np.ndarray
    bottom: np.ndarray
    conifer: np.ndarray


@dataclass(frozen=True)
class Canopy:
    """The vegetation above each cell.

    Attributes:
        top, bottom: height above the ground, m; 0 without vegetation.
        leaves: density of the foliage over its mean.
    """

    top: Raster
    bottom: Raster
    leaves: Raster


class Vegetation:
    """The vegetation of a survey; a plant depends on its place, not on the stretch."""

    def __init__(self, settings: SyntheticSettings) -> None:
        self._settings = settings
        names = ("stand", "stand detail", "scrub", "tree", "bush", "texture", "stand height",
                 "fields", "hedges", "hedge height", "thicket", "thicket detail")  # fmt: skip
        self._seeds = {name: field_seed(settings.seed, name) for name in names}
        # The share of a field above a threshold is estimated from a sample of it.
        sample = np.random.default_rng(0).uniform(0, 8000, (2, 20_000))
        self._stand_level = np.quantile(self._stand(*sample), 1 - settings.tree_cover)
        self._scrub_level = np.quantile(self._scrub(*sample), 1 - settings.bush_cover)
        self._hedge_level = np.quantile(self._hedge(*sample), 1 - settings.hedges)

    def _stand(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        coarse = value_noise(x, y, STAND_M, self._seeds["stand"])
        return coarse + 0.5 * value_noise(x, y, STAND_M / 3, self._seeds["stand detail"])

    def _scrub(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return value_noise(x, y, SCRUB_M, self._seeds["scrub"])

    def _hedge(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return value_noise(x, y, FIELD_M / 2, self._seeds["hedges"])

    def trees(self, bounds: tuple[float, float, float, float]) -> Plants:
        """Trees with stems within ``bounds`` (x min, y min, x max, y max; m)."""
        settings = self._settings
        x, y, draw = _candidates(bounds, TREE_CELL_M, self._seeds["tree"], 4)
        low, high = settings.tree_height
        # The trees of a stand have the same age.
        age = 0.5 + 0.5 * value_noise(x, y, 2 * STAND_M, self._seeds["stand height"])
        height = low + (high - low) * np.clip(0.02 + 0.8 * age + 0.5 * (draw[1] - 0.5), 0, 1)
        conifer = draw[2] < settings.conifers
        radius = np.where(conifer, 0.14, 0.24) * height * (0.7 + 0.6 * draw[3]) + 0.6
        bottom = np.where(conifer, 0.12, 0.22) * height * (0.3 + 1.4 * draw[0])
        keep = self._stand(x, y) > self._stand_level
        radius = np.minimum(radius, WIDEST_CROWN_M)
        return _select(keep, x, y, height, radius, bottom, conifer)

    def bushes(self, bounds: tuple[float, float, float, float]) -> Plants:
        """Bushes with stems within ``bounds`` (as ``trees``)."""
        x, y, draw = _candidates(bounds, BUSH_CELL_M, self._seeds["bush"], 2)
        height = 0.6 + 4.2 * draw[0] ** 2
        radius = 0.6 + 1.2 * draw[1]
        keep = self._scrub(x, y) > self._scrub_level
        nothing = np.zeros(len(x))
        return _select(keep, x, y, height, radius, nothing, nothing.astype(bool))

    def canopy(self, bounds: tuple[float, float, float, float], trees: Plants) -> Canopy:
        """The canopy over ``bounds``: of ``trees``, of bushes and of hedges."""
        from scenenet.synthetic.scene.crowns import paint

        top = Raster.covering(bounds, STEP_M)
        bottom = Raster.covering(bounds, STEP_M)
        x, y = top.nodes()
        # Branches; without this texture crowns would be bodies of revolution.
        texture = np.ones_like(top.values)
        for wavelength, share in ((2.2, 0.35), (0.8, 0.22)):
            texture += share * value_noise(x, y, wavelength, self._seeds["texture"])
        if self._settings.hedges:
            self._plant_hedges(top, x, y, texture)
        for plants in (self.bushes(bounds), trees):
            paint(
                top.values, bottom.values, top.i, top.j, STEP_M, texture,
                plants.x, plants.y, plants.height, plants.radius, plants.bottom, plants.conifer,
            )  # fmt: skip
        leaves = Raster(top.i, top.j, top.step, np.exp(self._thickness(x, y)))
        return Canopy(top, bottom, leaves)

    def _thickness(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Logarithm of the density of the foliage: thickets and open crowns."""
        stand = value_noise(x, y, STAND_M, self._seeds["thicket"])
        return 1.2 * stand + 1.2 * value_noise(x, y, THICKET_M, self._seeds["thicket detail"])

    def _plant_hedges(self, top: Raster, x: np.ndarray, y: np.ndarray, texture: np.ndarray) -> None:
        """Raise the canopy at hedges: along the zeros of a slowly varying field. The field divided
        by its slope is the distance to them."""
        field = value_noise(x, y, FIELD_M, self._seeds["fields"])
        slope = np.hypot(*np.gradient(field, STEP_M))
        on_border = np.abs(field) < HEDGE_HALF_WIDTH_M * texture * np.maximum(slope, 1e-4)
        grows = on_border & (self._hedge(x, y) > self._hedge_level)
        height = 2.2 + 1.0 * value_noise(x, y, FIELD_M / 3, self._seeds["hedge height"])
        top.values[grows] = (height * texture)[grows]


def _candidates(
    bounds: tuple[float, float, float, float], cell: float, seed: int, draws: int
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """A random place in each cell that overlaps ``bounds``, and ``draws`` random numbers for
    each."""
    i = np.arange(int(np.floor(bounds[0] / cell)), int(np.ceil(bounds[2] / cell)))
    j = np.arange(int(np.floor(bounds[1] / cell)), int(np.ceil(bounds[3] / cell)))
    i, j = (grid.ravel() for grid in np.meshgrid(i, j))
    random = [hash01(i, j, seed + k) for k in range(draws + 2)]
    return (i + random[0]) * cell, (j + random[1]) * cell, random[2:]


def _select(keep: np.ndarray, *columns: np.ndarray) -> Plants:
    return Plants(*(column[keep] for column in columns))


def keep_clear(plants: Plants, distance: np.ndarray, clearing: float) -> Plants:
    """The plants that, except for some branches, are ``clearing`` metres or more from the line;
    tall plants must be further away.

    Args:
        distance: (P,) of each plant from the line, m.
        clearing: m."""
    tall = PER_HEIGHT * np.maximum(plants.height - TALL_TREE_M, 0)
    return _select(
        distance - BRANCHES * plants.radius >= clearing + tall,
        plants.x,
        plants.y,
        plants.height,
        plants.radius,
        plants.bottom,
        plants.conifer,
    )
