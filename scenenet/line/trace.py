"""Trace the wires of a span: catenaries through pieces that continue one another."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenenet.line.bundles import subconductors
from scenenet.line.catenary import Catenary
from scenenet.line.fit import NOISE_M, SHORTEST_PARAMETER_M, Fit, Prior, fit_catenary
from scenenet.line.pieces import APART_M, WINDOW_M, Pieces, find_pieces, window_of

ON_WIRE_M = 0.35
"""m, distance up to which a piece agrees with a wire: half a bundle, and the error of a piece."""

IN_BUNDLE_M = 0.6
"""m, distance up to which points belong to a wire: the diagonal of a bundle of four."""

SLOPE = 0.06
"""Difference of slopes up to which a piece agrees with a wire: the error of a piece of 5 m."""

STEEPEST_ERROR = 0.15
"""The same for the shortest pieces, at most."""

SIDEWAYS = 0.25
"""Greatest change of t per metre along the span of its wires: 4 m more reach over 16 m."""

MIN_WINDOWS = 3
"""Windows in which a wire has a piece, at least."""

GAP_M = 60.0
"""m, longest gap in a wire of which it is not known that it leads from tower to tower."""

RING_M, CROWDED = 0.95, 0.5
"""m, radius of the ring around a wire, and points in it for each point of the wire from which the
wire is not in free air. Evenly spread points have 1.5."""

ROUNDING_M = 1e-6
"""m, added where points are left out because they cannot matter."""

MIN_COVERED = 0.3
"""Share of the windows between the ends of a wire that have a piece of it, at least."""

USUAL = Prior(1 / 1500.0, 1 / 1500.0)
"""Curvature of the wires of power lines: c is mostly from 500 to 2500 m. It only decides where a
wire is too short to show its own."""

TAUTEST_M = 10_000.0
"""m, greatest catenary parameter of a wire: what its strength allows."""

BENT_M, BENT_RMSE_M, CLOSER = 40.0, 2 * NOISE_M, 0.7
"""m, length and m, root mean square distance from which a wire may be two that meet at a crossarm,
and share of this distance at which a part of it must be nearer to its points."""

GROWN_M = 0.5
"""m that a wire grows by, at least, when it is fitted again to what it holds."""

PRIOR_SPREAD = 0.15
"""Standard deviation of the curvature of wires of a span, as a share of their median."""

MOST_GUESSES = 6000
"""Guesses that are compared at once."""

SINGLE = np.zeros((1, 2))
"""m, the offset of a single wire."""

FAR_M = 80.0
"""m, distance of two pieces from which a guess is as good as one from pieces further apart."""


@dataclass(frozen=True)
class Wire:
    """A wire in the frame of a span.

    Attributes:
        fit: the catenary, between the first and the last point.
        rows: rows of its points.
        covered: share of the windows between its ends in which it has points.
        crowd: points in the ring around it for each point on it, in the median of its windows.
        offsets: (k, 2) m, of its subconductors to the left of the catenary and above it. It is that
            of their middle.
    """

    fit: Fit
    rows: np.ndarray
    covered: float
    crowd: float
    offsets: np.ndarray


def trace_wires(
    stz: np.ndarray, rise: float = 0.0, gap: float = GAP_M, limit: int = 80
) -> list[Wire]:
    """The wires among points (n, 3) m in the frame of a span, the longest first.

    Args:
        rise: m per metre along the span, of the straight line between the feet of its towers.
        gap: m, longest one in a wire.
        limit: wires, at most.
    """
    if len(stz) == 0:
        return []
    window = window_of(float(np.ptp(stz[:, 0])))
    pieces = find_pieces(stz, window, rise)
    left = np.ones(len(pieces), bool)
    free = np.ones(len(stz), bool)
    found: list[Wire] = []
    guesses = _Guesses(pieces, left, window)
    while len(found) < limit:
        support = guesses.best(left)
        if support is None:
            if not guesses.cut:
                break
            guesses = _Guesses(pieces, left, window)
            continue
        fit = _fit(stz, pieces, support, free, _prior(found))
        while fit is not None and _may_bend(fit):
            part = _to_bend(pieces, support, fit, window)
            closer = _fit(stz, pieces, part, free, _prior(found))
            if closer is None or closer.rmse > CLOSER * fit.rmse:
                break
            support, fit = part, closer
        left[support] = False
        wire = None if fit is None else _whole(stz, fit, free, window, gap)
        if wire is None:
            continue
        # Pieces beside a wire are of its bundle or its noise.
        left[_near(pieces, wire.fit.catenary, window)] = False
        free[wire.rows] = False
        found.append(wire)
    return found


def _fit(
    stz: np.ndarray, pieces: Pieces, support: np.ndarray, free: np.ndarray, prior: Prior
) -> Fit | None:
    """The wire through the points of pieces that are on no other wire; None if there are too
    few."""
    if len(support) == 0:
        return None
    rows = np.unique(np.concatenate([pieces.members[number] for number in support]))
    rows = rows[free[rows]]
    return fit_catenary(stz[rows], np.ones(len(rows)), prior)


def _may_bend(fit: Fit) -> bool:
    """Whether a wire may be two that meet at a crossarm: it is long, and too straight or too far
    from its points for one."""
    curve = fit.catenary
    return curve.length >= BENT_M and (curve.parameter > TAUTEST_M or fit.rmse > BENT_RMSE_M)


def _to_bend(pieces: Pieces, support: np.ndarray, fit: Fit, window: float) -> np.ndarray:
    """The larger part of the pieces of a wire, from one end to where they are highest above it:
    wires that meet at a crossarm are highest there. No piece if that is at an end."""
    along, _ = fit.catenary.along(pieces.middle[support])
    _, above = fit.catenary.residuals(pieces.middle[support])
    inner = (along >= window) & (along <= along.max() - window)
    if not inner.any():
        return support[:0]
    before = along < along[inner][np.argmax(above[inner])]
    weight = pieces.weight[support]
    return support[before if weight[before].sum() >= weight[~before].sum() else ~before]


class _Guesses:
    """Parabolas through two pieces each, and the pieces that agree with them.

    Attributes:
        cut: whether there were more of them than are kept.
    """

    def __init__(self, pieces: Pieces, left: np.ndarray, window: float) -> None:
        """Guess from the pieces of ``window`` m that are ``left`` (P,)."""
        slope = min(SLOPE * WINDOW_M / window, STEEPEST_ERROR)
        self._pieces = pieces
        self._numbers = numbers = np.flatnonzero(left)
        s, t, z = pieces.middle[numbers].T
        ts, zs = pieces.slopes[numbers].T
        weight = pieces.weight[numbers]
        i, j = np.nonzero(s[None, :] - s[:, None] >= 2 * window)
        ds = s[j] - s[i]
        sideways, curvature = (t[j] - t[i]) / ds, (zs[j] - zs[i]) / ds
        # The chord of a parabola is as steep as the mean of its ends.
        chord = (z[j] - z[i]) / ds - (zs[i] + zs[j]) / 2
        good = np.abs(chord) <= slope / 2
        good &= np.abs(sideways) <= SIDEWAYS
        good &= (np.abs(sideways - ts[i]) <= slope) & (np.abs(sideways - ts[j]) <= slope)
        # The slopes of two pieces give a curvature with an error, which the chord does not have.
        error = slope / ds
        good &= (curvature >= -error) & (curvature <= 1 / SHORTEST_PARAMETER_M + error)
        kept = np.flatnonzero(good)
        self.cut = len(kept) > MOST_GUESSES
        if self.cut:
            worth = (weight[i] + weight[j])[kept] * np.minimum(ds[kept], FAR_M)
            kept = np.sort(kept[np.argsort(-worth, kind="stable")[:MOST_GUESSES]])
        i, j, ds, sideways, curvature = (c[kept] for c in (i, j, ds, sideways, curvature))
        from_i = s[None, :] - s[i, None]
        across = t[i, None] + sideways[:, None] * from_i
        rise = (z[j] - z[i]) / ds - curvature * ds / 2
        up = z[i, None] + (rise[:, None] + curvature[:, None] / 2 * from_i) * from_i
        steep = rise[:, None] + curvature[:, None] * from_i
        self._on = np.hypot(t - across, z - up) <= ON_WIRE_M
        self._on &= np.abs(zs - steep) <= slope
        self._on &= np.abs(ts - sideways[:, None]) <= slope
        self._seen = self._on.astype(np.float32)

    def best(self, left: np.ndarray) -> np.ndarray | None:
        """Numbers of the pieces that are ``left`` (P,) of the wire with most of them by length;
        None if none has ``MIN_WINDOWS``."""
        if len(self._on) == 0:
            return None
        free = left[self._numbers]
        weight = np.where(free, self._pieces.weight[self._numbers], 0.0)
        best = int(np.argmax(self._seen @ weight.astype(np.float32)))
        rows = self._numbers[np.flatnonzero(self._on[best] & free)]
        if len(np.unique(self._pieces.window[rows])) < MIN_WINDOWS:
            return None
        return rows


def _near(pieces: Pieces, catenary: Catenary, beyond: float) -> np.ndarray:
    """(P,) bool, which pieces lie beside a wire, or less than ``beyond`` m past its ends."""
    distance = np.hypot(*catenary.residuals(pieces.middle))
    along, _ = catenary.along(pieces.middle)
    inside = (along >= -beyond) & (along <= catenary.length + beyond)
    return inside & (distance <= APART_M)


def _whole(stz: np.ndarray, fit: Fit, free: np.ndarray, window: float, gap: float) -> Wire | None:
    """The wire with all its points and its true ends, or None if too little of it is seen.

    A fit may be to a part of a wire, or to one side of a bundle. The further away, the less certain
    is what it says of the rest. The fit to all that it reaches is better, so the wire grows until
    it is found up to its ends.
    """
    wire = _supported(stz, fit, free, window, gap)
    longest = float(np.ptp(stz[:, 0])) - window
    while wire is not None and wire.fit.catenary.length < longest:
        longer = _supported(stz, wire.fit, free, window, gap)
        if longer is None or longer.fit.catenary.length < wire.fit.catenary.length + GROWN_M:
            break
        wire = longer
    return wire


def _supported(
    stz: np.ndarray, fit: Fit, free: np.ndarray, window: float, gap: float
) -> Wire | None:
    """The wire with all its points and its true ends, or None if too little of it is seen."""
    catenary = fit.catenary
    along, left = catenary.along(stz)
    # Most points are further to its side than the ring, whatever their height.
    beside = np.abs(left - catenary.left(along)) <= RING_M + ROUNDING_M
    near = np.flatnonzero(free & beside)
    along, distance = along[near], np.hypot(*catenary.residuals(stz[near]))
    on = distance <= IN_BUNDLE_M
    if not on.any():
        return None
    beside = (distance > IN_BUNDLE_M) & (distance <= RING_M)
    seen = _clear_stretch(along[on], along[beside], window, gap)
    if seen is None:
        return None
    low, high, covered, crowd = seen
    if high - low < 2 * window or covered < MIN_COVERED:
        return None
    part = on & (along >= low) & (along <= high)
    ends = catenary.between(along[part].min(), along[part].max())
    return _bundled(stz, Wire(replace(fit, catenary=ends), near[part], covered, crowd, SINGLE))


def _clear_stretch(
    on: np.ndarray, beside: np.ndarray, window: float, gap: float
) -> tuple[float, float, float, float] | None:
    """Where a wire hangs in free air: start and end, m along it, of the longest stretch without a
    long gap, the share of its halves of windows that are clear, and the median over these of the
    points in the ring for each point on the wire. None if none is clear.

    Leaves are as dense around a wire as on it.

    Args:
        on, beside: m along the wire, of the points on it (n,) and of those in the ring around it.
        window: m.
        gap: m, from which one is long.
    """
    half = window / 2
    first = np.floor(on.min() / half)
    n = int(np.floor(on.max() / half) - first) + 1
    n_on, n_beside = (
        np.bincount(np.clip(np.floor(s / half) - first, 0, n - 1).astype(int), minlength=n)
        for s in (on, beside)
    )
    clear = np.flatnonzero((n_on > 0) & (n_beside <= CROWDED * n_on))
    if len(clear) == 0:
        return None
    gaps = np.flatnonzero(np.diff(clear) * half > gap)
    starts, stops = np.append(0, gaps + 1), np.append(gaps, len(clear) - 1)
    longest = int(np.argmax(stops - starts))
    part = clear[starts[longest] : stops[longest] + 1]
    covered = float(len(part) / (part[-1] - part[0] + 1))
    crowd = float(np.median(n_beside[part] / n_on[part]))
    return (first + part[0]) * half, (first + part[-1] + 1) * half, covered, crowd


def _bundled(stz: np.ndarray, wire: Wire) -> Wire:
    """The wire with its subconductors, if it is a bundle of them.

    Subconductors are parallel, so that their points lie at a few places when they are seen along
    the wire.
    """
    rows = wire.rows
    # A narrow fit may follow one subconductor, or go from one to another.
    wide = fit_catenary(stz[rows], np.ones(len(rows)), width=2 * IN_BUNDLE_M)
    if wide is None:
        return wire
    catenary = wide.catenary
    label, places = subconductors(np.column_stack(catenary.residuals(stz[rows])))
    if len(places) == 1:
        return wire
    # All points as if they were on one wire in the middle of the bundle.
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    own = label >= 0
    moved = stz[rows[own]].copy()
    moved[:, 1:] -= (places[label[own]] - middle) * [catenary.direction[0], 1.0]
    again = fit_catenary(moved, np.ones(len(moved)))
    if again is None:
        return wire
    return replace(wire, fit=again, offsets=places - middle)


def _prior(found: list[Wire]) -> Prior:
    """Curvature that the wires found so far suggest, or that most wires have."""
    if not found:
        return USUAL
    curvature = float(np.median([1 / wire.fit.catenary.parameter for wire in found]))
    return Prior(curvature, PRIOR_SPREAD * curvature)
