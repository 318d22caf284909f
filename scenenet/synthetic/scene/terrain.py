"""The ground: a smooth random height field, defined everywhere."""

from __future__ import annotations

import numpy as np

from scenenet.synthetic.scene.random_fields import Raster, blend, field_seed, value_noise
from scenenet.synthetic.settings import SyntheticSettings

STEP_M = 1.0
"""Distance between nodes; the ground is bilinear between them, m."""

LONGEST_M = 280.0
"""Wavelength of the hills."""

OCTAVES = 8
"""Number of octaves, each at half the wavelength of the previous one: 280 m down to about 2 m."""

TERRACE_M = 1.6
"""Height of the step of a terrace, m."""

RISER = 0.25
"""Share of a terrace's height range that is the sloping wall; the rest is level."""

TERRACED_M = 110.0
"""Extent of terraced areas, m."""


class Terrain:
    """Elevation of the ground, m, at any place (x, y in metres from the start of the line).

    Octaves of value noise (fractal noise): the first makes the hills, each further one has half the
    wavelength of the previous one and a share of its amplitude that depends on ``roughness``.
    """

    def __init__(self, settings: SyntheticSettings) -> None:
        self._elevation = settings.elevation
        # At roughness 0.5 the amplitude falls about as the wavelength does, so slopes are equally
        # steep at every scale. The range keeps the ground walkable at roughness 1.
        persistence = 0.25 + 0.3 * settings.roughness
        amplitudes = persistence ** np.arange(OCTAVES)
        self._amplitudes = 0.5 * settings.relief * amplitudes / amplitudes.sum()
        self._wavelengths = LONGEST_M * 0.5 ** np.arange(OCTAVES)
        self._seeds = [field_seed(settings.seed, f"terrain {k}") for k in range(OCTAVES)]
        self._terrace_seed = field_seed(settings.seed, "terraces")
        self._terrace_level = self._level(settings.terraces)

    def _level(self, share: float) -> float:
        """Level that the field of terraces exceeds on ``share`` of the plane; terraces are
        there."""
        if share == 0:
            return np.inf
        x, y = np.random.default_rng(0).uniform(0, 12_000, (2, 20_000))
        return float(np.quantile(value_noise(x, y, TERRACED_M, self._terrace_seed), 1 - share))

    def _node(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        z = np.full(np.shape(x), self._elevation)
        octaves = zip(self._wavelengths, self._amplitudes, self._seeds, strict=True)
        for wavelength, amplitude, seed in octaves:
            if amplitude:
                z += amplitude * value_noise(x, y, wavelength, seed)
        return z if np.isinf(self._terrace_level) else self._terraced(x, y, z)

    def _terraced(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Elevations ``z`` with level steps in terraced areas."""
        mask = value_noise(x, y, TERRACED_M, self._terrace_seed) - self._terrace_level
        steps = np.floor(z / TERRACE_M)
        climb = np.clip((z / TERRACE_M - steps - (1 - RISER)) / RISER, 0, 1)
        level = TERRACE_M * (steps + climb)
        return z + np.clip(12 * mask, 0, 1) * (level - z)

    def raster(self, bounds: tuple[float, float, float, float]) -> Raster:
        """The ground over ``bounds`` (x min, y min, x max, y max; m) for many look-ups.

        ``raster(...).bilinear(x, y)`` equals ``height(x, y)`` for any bounds.
        """
        raster = Raster.covering(bounds, STEP_M)
        raster.values[:] = self._node(*raster.nodes())
        return raster

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Elevation (N,) at places (N,), m; efficient for a few places."""
        u, v = np.asarray(x, float) / STEP_M, np.asarray(y, float) / STEP_M
        i, j = np.floor(u), np.floor(v)
        v00, v10, v01, v11 = (
            self._node((i + di) * STEP_M, (j + dj) * STEP_M) for dj in (0, 1) for di in (0, 1)
        )
        return blend(v00, v10, v01, v11, u - i, v - j)
