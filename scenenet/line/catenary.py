"""The catenary: the curve of a wire that hangs between two attachments.

In the vertical plane through its attachments, with s along it: z(s) = c cosh((s - s0) / c) + k. The
catenary parameter c (m) is the horizontal tension over the weight per metre. The wire of a span L
sags by about L^2 / (8 c). Wind moves it out of that plane, most in the middle of the span.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

TAUT_M = 1e5
"""m, catenary parameter from which a wire is straight: its sag over 300 m is 0.1 m."""


@dataclass(frozen=True)
class Catenary:
    """A wire between two points.

    Attributes:
        start, end: (x, y, z), m.
        parameter: c, m.
        blowout: m, how far the wind moves its middle to the left; less elsewhere, as a parabola.
    """

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    parameter: float
    blowout: float = 0.0

    @classmethod
    def of(
        cls, start: np.ndarray, end: np.ndarray, parameter: float, blowout: float = 0.0
    ) -> Catenary:
        """Between two points (3,) m."""
        x, y, z = map(float, start)
        far = float(end[0]), float(end[1]), float(end[2])
        return cls((x, y, z), far, parameter, blowout)

    @cached_property
    def length(self) -> float:
        """m, horizontal distance between the ends."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))

    @cached_property
    def direction(self) -> np.ndarray:
        """(2,) horizontal unit vector from start to end."""
        return (np.array(self.end[:2]) - self.start[:2]) / self.length

    @cached_property
    def lowest(self) -> float:
        """m, distance s along the wire, from its start, at which the curve is lowest. It may lie
        beyond the ends."""
        c, rise = self.parameter, self.end[2] - self.start[2]
        return self.length / 2 - c * np.arcsinh(rise / (2 * c * np.sinh(self.length / (2 * c))))

    def height(self, s: np.ndarray) -> np.ndarray:
        """z (n,), m, at horizontal distances s (n,) m from the start; beyond the ends too."""
        c = self.parameter
        return self.start[2] + c * (np.cosh((s - self.lowest) / c) - np.cosh(self.lowest / c))

    def slope(self, s: np.ndarray) -> np.ndarray:
        """Rise (n,) per horizontal metre at distances s (n,) m from the start."""
        return np.sinh((s - self.lowest) / self.parameter)

    def left(self, s: np.ndarray) -> np.ndarray:
        """m (n,), how far wind moves the wire to the left of the straight line in plan at distances
        s (n,) m from the start."""
        return self._blown(s / self.length)

    def at(self, s: np.ndarray) -> np.ndarray:
        """Points (n, 3), m, at horizontal distances s (n,) m from the start."""
        return self.at_shares(np.asarray(s, float) / self.length)

    def at_shares(self, u: np.ndarray) -> np.ndarray:
        """Points (n, 3), m, at shares u (n,) of the horizontal distance from start to end."""
        (x, y, _), (far_x, far_y, _) = self.start, self.end
        z = self.height(u * self.length)
        places = np.column_stack((x + u * (far_x - x), y + u * (far_y - y), z))
        if self.blowout:
            east, north = self.direction
            places[:, :2] += self._blown(u)[:, None] * np.array([-north, east])
        return places

    def _blown(self, u: np.ndarray) -> np.ndarray:
        """m to the left at shares u of the length."""
        return 4 * self.blowout * u * (1 - u)

    def along(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """s along the wire from its start, and t to its left, each (n,) m, of points (n, 2 or 3)
        m."""
        east, north = xyz[:, 0] - self.start[0], xyz[:, 1] - self.start[1]
        dx, dy = self.direction
        return east * dx + north * dy, north * dx - east * dy

    def residuals(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far points (n, 3) m are to the left of the curve, and above it at a right angle to
        it, each (n,) m. The ends do not limit the curve."""
        s, t = self.along(xyz)
        t = t - self._blown(s / self.length)
        above = (xyz[:, 2] - self.height(s)) / np.sqrt(1 + self.slope(s) ** 2)
        return t, above

    def between(self, first: float, last: float) -> Catenary:
        """The same curve between other distances from the start, m."""
        start, end = self.at(np.array([first, last]))
        blowout = float(self.blowout * ((last - first) / self.length) ** 2)
        return Catenary.of(start, end, self.parameter, blowout)

    @cached_property
    def sag(self) -> float:
        """m, greatest vertical distance from the straight line between the ends to the wire."""
        # It is where the wire is as steep as that line.
        steepness = (self.end[2] - self.start[2]) / self.length
        s = self.lowest + self.parameter * np.arcsinh(steepness)
        return float(self.start[2] + steepness * s - self.height(np.array([s]))[0])

    @cached_property
    def arc_length(self) -> float:
        """m, length of the wire itself."""
        ends = (np.array([0.0, self.length]) - self.lowest) / self.parameter
        return float(self.parameter * np.diff(np.sinh(ends))[0])
