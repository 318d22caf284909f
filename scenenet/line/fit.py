"""Fit a catenary to points, robustly."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from scenenet.core.compilation import EXACT
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
after which outliers are recognised by the full width, and change of a weight at which they end."""


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
    known = None if prior is None else (prior.curvature, NOISE_M / prior.spread)
    s, t, z = np.ascontiguousarray(stz.T)
    weights = start.astype(float)
    curvature, rise = 0.0 if prior is None else prior.curvature, 0.0
    for number in range(ITERATIONS):
        used = weights > 0
        if used.sum() < 4:
            return None
        low, high = float(s[used].min()), float(s[used].max())
        length = high - low
        if length <= 0:
            return None
        bowed = _bowed(s, low, length)
        beside = _solve(bowed, t, weights, (0.0, NOISE_M / (BLOWOUT * length)))
        stretch = np.hypot(1.0, (beside[1] - beside[0]) / length)  # per metre along s
        # z is nearly linear in the heights of the ends and 1 / c: a parabola, and a small rest
        # that the last curvature gives.
        basis, above = _hung(bowed, z, length * stretch, rise, curvature)
        first, last, curvature = _solve(basis, above, weights, known)
        rise = float(last - first)
        curvature = float(np.clip(curvature, 1 / TAUT_M, 1 / SHORTEST_PARAMETER_M))
        catenary = Catenary(
            (low, float(beside[0]), float(first)), (high, float(beside[1]), float(last)),
            1 / curvature, float(beside[2]),
        )  # fmt: skip
        distance = _distance(s, t, z, catenary)
        spread = max(NOISE_M, float(np.median(distance[used])) / RAYLEIGH_MEDIAN)
        # From wide to narrow: the first fits are those of all points, outliers too.
        scale = min(TUKEY * spread, width * 2.0 ** max(WIDE - number, 0))
        if number < PLAIN:
            continue
        before = weights
        weights = np.where(distance < scale, (1 - (distance / scale) ** 2) ** 2, 0.0)
        if number > PLAIN + WIDE and np.abs(weights - before).max() < CHANGE:
            break
    used = weights > 0
    if used.sum() < 4:
        return None
    along, _ = catenary.along(stz)
    ends = catenary.between(float(along[used].min()), float(along[used].max()))
    return Fit(ends, weights, float(np.sqrt(np.mean(distance[used] ** 2))))


def _hung(
    bowed: np.ndarray, z: np.ndarray, span: float, rise: float, curvature: float
) -> tuple[np.ndarray, np.ndarray]:
    """What the heights (n,) m of points are linear in, (n, 3), and those heights: without what a
    catenary is above its parabola. It is further above where the wire is steep."""
    c = 1 / max(curvature, 1 / TAUT_M)
    lowest = Catenary((0.0, 0.0, 0.0), (span, 0.0, rise), c).lowest
    return _parabola(bowed, z, span, span**2, rise, curvature, c, lowest, np.cosh(lowest / c))


def _distance(s: np.ndarray, t: np.ndarray, z: np.ndarray, catenary: Catenary) -> np.ndarray:
    """(n,) m, from points to a catenary: the length of ``Catenary.residuals``."""
    c, lowest = catenary.parameter, catenary.lowest
    direction, length = catenary.direction.tolist(), catenary.length
    place = *catenary.start, *direction, length, c, lowest, np.cosh(lowest / c), catenary.blowout
    return np.asarray(_measured(s, t, z, place))


@numba.njit(**EXACT)
def _bowed(s, low, length):  # pragma: no cover - compiled
    """(n, 3) shares of the start, of the end and of the middle of a wire."""
    found = np.empty((len(s), 3))
    for i in range(len(s)):
        u = (s[i] - low) / length
        # By number: numba compiles a check of shapes into the assignment of a row, for seconds.
        found[i, 0], found[i, 1], found[i, 2] = 1 - u, u, 4 * u * (1 - u)
    return found


@numba.njit(**EXACT)
def _parabola(
    bowed, z, span, squared, rise, curvature, c, lowest, at_start
):  # pragma: no cover - compiled
    """What ``_hung`` gives."""
    basis, above = np.empty_like(bowed), np.empty(len(z))
    for i in range(len(z)):
        u = bowed[i, 1]
        basis[i, 0], basis[i, 1], basis[i, 2] = 1 - u, u, -(squared / 2 * u * (1 - u))
        height = c * (np.cosh((u * span - lowest) / c) - at_start)
        above[i] = z[i] - (height - rise * u + curvature * squared / 2 * u * (1 - u))
    return basis, above


@numba.njit(**EXACT)
def _measured(s, t, z, place):  # pragma: no cover - compiled
    """What ``_distance`` gives."""
    x, y, bottom, dx, dy, length, c, lowest, at_start, blowout = place
    distance = np.empty(len(s))
    for i in range(len(s)):
        east, north = s[i] - x, t[i] - y
        along = east * dx + north * dy
        u = along / length
        beside = north * dx - east * dy - 4 * blowout * u * (1 - u)
        height = bottom + c * (np.cosh((along - lowest) / c) - at_start)
        slope = np.sinh((along - lowest) / c)
        distance[i] = np.hypot(beside, (z[i] - height) / np.sqrt(1 + slope * slope))
    return distance


def _solve(
    basis: np.ndarray,
    values: np.ndarray,
    weights: np.ndarray,
    known: tuple[float, float] | None = None,
) -> np.ndarray:
    """(k,) coefficients by weighted least squares; ``known`` is a value of the last one and the
    weight of it."""
    normal = basis.T @ (basis * weights[:, None])
    towards = basis.T @ (values * weights)
    if known is not None:
        normal[-1, -1] += known[1] ** 2
        towards[-1] += known[0] * known[1] ** 2
    return np.linalg.lstsq(normal, towards, rcond=None)[0]
