"""The ground of one stretch of a survey."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

Numbers = np.ndarray | float


@dataclass(frozen=True)
class Strip:
    """The places with |t| <= half_width and low + t k0 <= s < high + t k1.

    s is the distance along the span from its first tower, t that to the left of it, both m. Borders
    at bends follow the bisector, so that stretches neither overlap nor leave gaps.

    Attributes:
        x, y: first tower of the span, m.
        azimuth: direction of the span, radians from east.
        low, high: start and end of the strip on the line, m.
        k0, k1: slopes ds/dt of the borders at the start and the end.
        half_width: m.
    """

    x: float
    y: float
    azimuth: float
    low: float
    high: float
    k0: float
    k1: float
    half_width: float

    def holds(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """(N,) bool: which places on the map are in the strip."""
        s, t = self.to_strip(x, y)
        between = (s >= self.low + t * self.k0) & (s < self.high + t * self.k1)
        return between & (np.abs(t) <= self.half_width)

    @property
    def area(self) -> float:
        """Area, m^2."""
        return 2 * self.half_width * (self.high - self.low)

    @property
    def first(self) -> float:
        """Least s of any place in the strip."""
        return self.low - abs(self.k0) * self.half_width

    @property
    def last(self) -> float:
        """Greatest s of any place in the strip."""
        return self.high + abs(self.k1) * self.half_width

    def scatter(self, n: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """x and y of about ``n`` random places, uniform over the strip."""
        w = self.half_width
        n_box = rng.poisson(n * (self.last - self.first) / (self.high - self.low))
        s = self.first + (self.last - self.first) * rng.random(n_box)
        t = w * (2 * rng.random(n_box) - 1)
        keep = (s >= self.low + t * self.k0) & (s < self.high + t * self.k1)
        return self.to_map(s[keep], t[keep])

    def to_map(self, s: Numbers, t: Numbers) -> tuple[Any, Any]:
        """x and y on the map of places (s, t); numbers or arrays."""
        cos, sin = np.cos(self.azimuth), np.sin(self.azimuth)
        return self.x + s * cos - t * sin, self.y + s * sin + t * cos

    def to_strip(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """s and t of places (N,) on the map."""
        cos, sin = np.cos(self.azimuth), np.sin(self.azimuth)
        dx, dy = x - self.x, y - self.y
        return dx * cos + dy * sin, dy * cos - dx * sin

    def bounds(self, reach: float = 0.0) -> tuple[float, float, float, float]:
        """x min, y min, x max, y max of the strip, extended by ``reach`` metres."""
        w = self.half_width
        t = np.array([-w, w, -w, w])
        s = np.array([self.low, self.low, self.high, self.high])
        s = s + t * np.array([self.k0, self.k0, self.k1, self.k1])
        x, y = self.to_map(s, t)
        return x.min() - reach, y.min() - reach, x.max() + reach, y.max() + reach
