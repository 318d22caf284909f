"""Steps of coordinates that are too coarse: those of float32 numbers, or of a large LAS scale."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

COARSE = 0.05
"""Steps of float32 numbers that matter, in the unit of the coordinates."""
COARSE_SCALE = 0.1
"""Steps of a LAS file that matter; survey standards are 0.01 m and finer."""
MIN_POINTS = 20


class CoordinateSteps:
    """Whether all coordinates along an axis are float32 numbers.

    A float32 number at 4.6 million has steps of half a metre. Points on a regular raster can be
    float32 numbers too, but they do not use every step.
    """

    def __init__(self, scales: Sequence[float] | None) -> None:
        self._scales = np.zeros(3) if scales is None else np.abs(np.asarray(scales, float))
        self._single = np.ones(3, bool)
        self._odd, self._even = np.zeros(3, bool), np.zeros(3, bool)
        self._usual = np.zeros(3)
        self._n = 0

    def add(self, xyz: np.ndarray) -> None:
        """Look at points (n, 3)."""
        self._n += len(xyz)
        self._usual = np.maximum(self._usual, np.median(np.abs(xyz), axis=0))
        with np.errstate(over="ignore"):
            single = xyz.astype(np.float32)
        # A LAS file rounds a float32 number to its own steps.
        rounding = 0.51 * self._scales + 1e-12 * np.abs(xyz)
        self._single &= (np.abs(xyz - single) <= rounding).all(axis=0)
        if not self._single.any():
            return
        step = np.spacing(np.abs(single)).astype(np.float64)
        finite = np.isfinite(single) & (step > 0)
        number = np.round(np.divide(single, step, out=np.zeros(xyz.shape), where=finite))
        self._odd |= (number % 2 == 1).any(axis=0)
        self._even |= (number % 2 == 0).any(axis=0)

    def findings(self) -> list[tuple[str, str]]:
        """(kind, text) of steps that are too coarse."""
        found = []
        if (self._scales > COARSE_SCALE).any():
            steps = " x ".join(f"{step:g}" for step in self._scales)
            found.append(("scale", f"coordinates are stored in steps of {steps}, which is coarse"))
        step = np.spacing(self._usual.astype(np.float32)).astype(np.float64)
        coarse = self._single & self._odd & self._even
        coarse &= (step >= COARSE) & (step >= 10 * self._scales)
        if self._n >= MIN_POINTS and coarse.any():
            axes = ", ".join(
                f"{name} in steps of {step[axis]:g} at {self._usual[axis]:.0f}"
                for axis, name in enumerate("xyz")
                if coarse[axis]
            )
            found.append(
                (
                    "float32",
                    "the coordinates are rounded as float32 numbers are, so points have moved "
                    f"({axes}). Export the survey again with float64 coordinates, or subtract an "
                    "offset first",
                )
            )
        return found
