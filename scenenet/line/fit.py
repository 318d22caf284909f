"""Fit a catenary to points, robustly."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from scenenet.core.compilation import COMPILED
from scenenet.line.catenary import TAUT_M, Catenary

SHORTEST_PARAMETER_M = 60.0
"""m, least catenary parameter of a wire of a power line; a slack jumper has less."""

NOISE_M = 0.03
"""m, least spread of points about a wire: what a survey scanner measures to."""

BLOWOUT = 1e-3
"""Share of its length by which the wind moves the middle of a wire sideways: 0.3 m of 300 m, as
far as a survey is flown in little wind. It is a prior, not a limit."""

TUKEY = 4.685
"""Robust standard deviations from which a residual has no weight (Tukey's biweight, 95 % as
efficient as least squares for normal errors)."""

RAYLEIGH_MEDIAN = 1.177
"""Median distance from a wire over the standard deviation to one side, for normal errors."""

ITERATIONS, PLAIN, WIDE, CHANGE = 20, 2, 5, 1e-3
"""Iterations at most, those at the start without weights, in which the curvature is found, those
after which outliers are told by the full width, and change of a weight at which they end."""

EPSILON = float(np.finfo(float).eps)
"""Share of the largest singular value below which one is 0."""


@dataclass(frozen=True)
class Prior:
    """What is known of the curvature of a wire before it is fitted: that of its neighbours, which
    hang at about the same tension.

    Attributes:
        curvature: 1 / c, 1/m.
        spread: 1/m, its standard deviation.
    """

    curvature: float
    spread: float


@dataclass(frozen=True)
class Fit:
    """A catenary and how well points agree with it.

    Attributes:
        catenary: between the first and the last point.
        weights: (n,) in [0, 1], of the points; 0 for outliers.
        rmse: m, root mean square distance of the points with a weight from the curve.
    """

    catenary: Catenary
    weights: np.ndarray
    rmse: float


def fit_catenary(
    stz: np.ndarray, start: np.ndarray, prior: Prior | None = None, width: float = 0.3
) -> Fit | None:
    """Fit a catenary by iteratively reweighted least squares.

    Args:
        stz: (n, 3) m, points along, beside and above, in any frame with level s and t in which the
            wire runs along s.
        start: (n,) in [0, 1], weights of the points to begin with.
        prior: of the curvature; None for none.
        width: m, distance from which a point is an outlier, whatever the spread.

    Returns:
        The fit in the same frame, or None if the points do not say where the wire is.
    """
    known = (0.0, 0.0) if prior is None else (prior.curvature, NOISE_M / prior.spread)
    weights, distance = start.astype(float), np.empty(len(stz))
    s, t, z = np.ascontiguousarray(stz.T)
    shape = _iterated(s, t, z, weights, distance, known, width)
    used = weights > 0
    if shape is None or used.sum() < 4:
        return None
    low, high, left, left_end, first, last, curvature, blowout = shape
    catenary = Catenary((low, left, first), (high, left_end, last), 1 / curvature, blowout)
    along, _ = catenary.along(stz)
    ends = catenary.between(float(along[used].min()), float(along[used].max()))
    return Fit(ends, weights, float(np.sqrt(np.mean(distance[used] ** 2))))


@numba.njit(**COMPILED)
def _iterated(s, t, z, weights, distance, known, width):  # pragma: no cover - compiled
    """The last of the catenaries that are fitted: s of its ends, t of both, z of both, 1 / c and
    blowout; None where too few points have a weight.

    Args:
        s, t, z: (n,) m.
        weights: (n,), changed to those of the fit.
        distance: (n,) m, overwritten: from the catenary.
        known: prior curvature and its weight, 0 for none.
        width: as ``fit_catenary`` takes it.
    """
    n = len(s)
    across, above, rest = np.empty((n, 3)), np.empty((n, 3)), np.empty(n)
    curvature, rise = known[0], 0.0
    shape = (0.0,) * 8
    for number in range(ITERATIONS):
        used = np.flatnonzero(weights > 0)
        if len(used) < 4:
            return None
        low, high = s[used].min(), s[used].max()
        length = high - low
        if length <= 0:
            return None
        for i in range(n):
            u = (s[i] - low) / length
            across[i] = 1 - u, u, 4 * u * (1 - u)
        left, left_end, blowout = _solve(across, t, weights, 0.0, NOISE_M / (BLOWOUT * length))
        stretch = np.hypot(1.0, (left_end - left) / length)  # per metre along s
        span = length * stretch
        # z is nearly linear in the heights of the ends and 1 / c: a parabola, and a small rest
        # that the last curvature gives.
        c = 1 / max(curvature, 1 / TAUT_M)
        lowest = _lowest(span, rise, c)
        start = np.cosh(lowest / c)
        for i in range(n):
            u = across[i, 1]
            bow = span**2 / 2 * u * (1 - u)
            above[i] = 1 - u, u, -bow
            over = c * (np.cosh((u * span - lowest) / c) - start)
            rest[i] = z[i] - (over - rise * u + curvature * bow)
        first, last, curvature = _solve(above, rest, weights, *known)
        rise = last - first
        curvature = min(max(curvature, 1 / TAUT_M), 1 / SHORTEST_PARAMETER_M)
        shape = (low, high, left, left_end, first, last, curvature, blowout)
        _measure(s, t, z, shape, distance)
        spread = max(NOISE_M, np.median(distance[used]) / RAYLEIGH_MEDIAN)
        # From wide to narrow: the first fits are those of all points, outliers too.
        scale = min(TUKEY * spread, width * 2.0 ** max(WIDE - number, 0))
        if number < PLAIN:
            continue
        change = 0.0
        for i in range(n):
            weight = (1 - (distance[i] / scale) ** 2) ** 2 if distance[i] < scale else 0.0
            change = max(change, abs(weight - weights[i]))
            weights[i] = weight
        if number > PLAIN + WIDE and change < CHANGE:
            break
    return shape


@numba.njit(**COMPILED)
def _lowest(length, rise, c):  # pragma: no cover - compiled
    """``Catenary.lowest``."""
    return length / 2 - c * np.arcsinh(rise / (2 * c * np.sinh(length / (2 * c))))


@numba.njit(**COMPILED)
def _measure(s, t, z, shape, distance):  # pragma: no cover - compiled
    """Write the distances of points from a catenary into ``distance``: the length of
    ``Catenary.residuals``."""
    low, high, left, left_end, first, last, curvature, blowout = shape
    length, c = np.hypot(high - low, left_end - left), 1 / curvature
    dx, dy = (high - low) / length, (left_end - left) / length
    lowest = _lowest(length, last - first, c)
    start = np.cosh(lowest / c)
    for i in range(len(s)):
        east, north = s[i] - low, t[i] - left
        along = east * dx + north * dy
        u = along / length
        beside = north * dx - east * dy - 4 * blowout * u * (1 - u)
        height = first + c * (np.cosh((along - lowest) / c) - start)
        slope = np.sinh((along - lowest) / c)
        distance[i] = np.hypot(beside, (z[i] - height) / np.sqrt(1 + slope**2))


@numba.njit(**COMPILED)
def _solve(basis, values, weights, expected, weight):  # pragma: no cover - compiled
    """Coefficients (3,) by weighted least squares for a basis (n, 3); the last one is ``expected``
    with a weight."""
    normal, towards = np.zeros((3, 3)), np.zeros(3)
    for i in range(len(values)):
        for j in range(3):
            weighted = basis[i, j] * weights[i]
            towards[j] += weighted * values[i]
            for k in range(3):
                normal[j, k] += weighted * basis[i, k]
    normal[2, 2] += weight**2
    towards[2] += expected * weight**2
    return np.linalg.lstsq(normal, towards, 3 * EPSILON)[0]
