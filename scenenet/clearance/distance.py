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
    z, length = xyz[:, 2], curve.length
    u = np.clip(s, 0.0, length)
    for _ in range(STEPS):
        slope, above = curve.slope(u), curve.height(u) - z
        turn, beside = 4 * curve.blowout * (1 - 2 * u / length) / length, curve.left(u) - t
        change = (u - s) + above * slope + beside * turn
        bend = 1 + slope**2 + above * np.sqrt(1 + slope**2) / curve.parameter
        bend += turn**2 - beside * 8 * curve.blowout / length**2
        u = np.clip(u - change / np.maximum(bend, 0.2), 0.0, length)
    distance = np.sqrt((u - s) ** 2 + (curve.height(u) - z) ** 2 + (curve.left(u) - t) ** 2)
    return Nearest(u, distance)


def bounds(curve: Catenary, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances in m between which those of points (n, 3) m from a wire lie, each (n,).

    They need one look at the curve instead of several: the wire abreast of a point is not nearer
    than the nearest place, and the wire is nowhere steeper, or more turned, than at an end.
    """
    s, t = curve.along(xyz)
    u = np.clip(s, 0.0, curve.length)
    steepest = np.abs(curve.slope(np.array([0.0, curve.length]))).max()
    flat = (s - u) ** 2 + (curve.height(u) - xyz[:, 2]) ** 2
    beside = np.abs(t - curve.left(u))
    upper = np.sqrt(flat + beside**2)
    # The nearest place is at most as far along the wire as the point is from it.
    turned = np.maximum(beside - 4 * abs(curve.blowout) / curve.length * upper, 0.0)
    return np.sqrt(flat / (1 + steepest**2) + turned**2), upper
