"""How far points are from a conductor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.line.catenary import Catenary

STEPS = 5
"""Newton steps to the nearest place on a wire. Within 40 m of a wire with c = 300 m, each step
leaves less than a twentieth of the error."""


@dataclass(frozen=True)
class Nearest:
    """The nearest places on a wire.

    Attributes:
        along: (n,) m, horizontal distance from the start of the wire.
        distance: (n,) m, in space.
    """

    along: np.ndarray
    distance: np.ndarray


def nearest_on(curve: Catenary, xyz: np.ndarray) -> Nearest:
    """The nearest places on a wire, between its ends, to points (n, 3) m."""
    s, t = curve.along(xyz)
    z = xyz[:, 2]
    u = np.clip(s, 0.0, curve.length)
    for _ in range(STEPS):
        slope, above = curve.slope(u), curve.height(u) - z
        change = (u - s) + above * slope
        bend = 1 + slope**2 + above * np.sqrt(1 + slope**2) / curve.parameter
        u = np.clip(u - change / np.maximum(bend, 0.2), 0.0, curve.length)
    distance = np.sqrt((u - s) ** 2 + (curve.height(u) - z) ** 2 + t**2)
    return Nearest(u, distance)


def bounds(curve: Catenary, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances in m between which those of points (n, 3) m from a wire lie, each (n,).

    They need one look at the curve instead of several: the wire abreast of a point is not nearer
    than the nearest place, and the wire is nowhere steeper than at an end.
    """
    s, t = curve.along(xyz)
    u = np.clip(s, 0.0, curve.length)
    steepest = np.abs(curve.slope(np.array([0.0, curve.length]))).max()
    flat = (s - u) ** 2 + (curve.height(u) - xyz[:, 2]) ** 2
    return np.sqrt(flat / (1 + steepest**2) + t**2), np.sqrt(flat + t**2)
