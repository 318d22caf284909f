"""Conductors and earth wires between consecutive towers."""

from __future__ import annotations

import numpy as np


def catenary(start: np.ndarray, end: np.ndarray, parameter: float, u: np.ndarray) -> np.ndarray:
    """Points (N, 3) of a wire hanging between ``start`` and ``end`` (3,), at shares ``u`` of the
    horizontal way (N,).

    z = c cosh((s - s0) / c) + k with the catenary parameter c = tension / weight per metre (m);
    s0 and k follow from the two ends, which may lie at different heights.
    """
    step = end - start
    length = float(np.hypot(step[0], step[1]))
    half = length / (2 * parameter)
    lowest = length / 2 - parameter * np.arcsinh(step[2] / (2 * parameter * np.sinh(half)))
    s = u * length
    z = parameter * (np.cosh((s - lowest) / parameter) - np.cosh(lowest / parameter))
    return np.column_stack((start[0] + u * step[0], start[1] + u * step[1], start[2] + z))


def string_wires(
    starts: np.ndarray,
    ends: np.ndarray,
    parameter: float,
    density: float,
    rng: np.random.Generator,
    window: tuple[float, float] = (0.0, 1.0),
) -> np.ndarray:
    """Points (N, 3) of the wires from ``starts`` to ``ends`` (W, 3), ``density`` per metre.

    Args:
        window: only this part of the way is scanned (shares of the horizontal way).
    """
    low, high = window
    points = []
    for start, end in zip(starts, ends, strict=True):
        length = np.linalg.norm(end - start) * (high - low)
        u = low + (high - low) * rng.random(rng.poisson(length * density))
        points.append(catenary(start, end, parameter, u))
    return np.concatenate(points)
