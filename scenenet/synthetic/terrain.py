"""The ground: a smooth, seeded height field that has a value everywhere."""

from __future__ import annotations

import numpy as np

from scenenet.synthetic.noise import Raster, blend, field_seed, value_noise
from scenenet.synthetic.settings import SyntheticSettings

STEP_M = 1.0
"""Distance of the nodes between which the ground is bilinear."""

LONGEST_M = 280.0
"""Wavelength of the hills."""

OCTAVES = 8
"""Each at half the wavelength of the one before: 280 m down to about 2 m."""


class Terrain:
    """Elevation of the ground, m, at any place (x, y in metres from the start of the line).

    Octaves of value noise (fractal noise): the first carries the hills, each next one a share
    ``roughness`` of the one before, at half the wavelength.
    """

    def __init__(self, settings: SyntheticSettings) -> None:
        self._elevation = settings.elevation
        # At roughness 0.5 amplitude falls as the wavelength does: slopes of equal steepness at
        # every scale. The range used keeps the ground walkable at 1.
        persistence = 0.25 + 0.3 * settings.roughness
        amplitudes = persistence ** np.arange(OCTAVES)
        self._amplitudes = 0.5 * settings.relief * amplitudes / amplitudes.sum()
        self._wavelengths = LONGEST_M * 0.5 ** np.arange(OCTAVES)
        self._seeds = [field_seed(settings.seed, f"terrain {k}") for k in range(OCTAVES)]

    def _node(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        z = np.full(np.shape(x), self._elevation)
        octaves = zip(self._wavelengths, self._amplitudes, self._seeds, strict=True)
        for wavelength, amplitude, seed in octaves:
            if amplitude:
                z += amplitude * value_noise(x, y, wavelength, seed)
        return z

    def raster(self, bounds: tuple[float, float, float, float]) -> Raster:
        """The ground over ``bounds`` (x min, y min, x max, y max; m) for many look-ups.

        ``raster(...).bilinear(x, y)`` equals ``height(x, y)``, whatever the bounds.
        """
        raster = Raster.covering(bounds, STEP_M)
        raster.values[:] = self._node(*raster.nodes())
        return raster

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Elevation (N,) at a few places (N,) anywhere."""
        u, v = np.asarray(x, float) / STEP_M, np.asarray(y, float) / STEP_M
        i, j = np.floor(u), np.floor(v)
        v00, v10, v01, v11 = (
            self._node((i + di) * STEP_M, (j + dj) * STEP_M) for dj in (0, 1) for di in (0, 1)
        )
        return blend(v00, v10, v01, v11, u - i, v - j)
