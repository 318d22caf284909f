"""Portals: two poles across the line with a beam between them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from scenenet.detection.head import AIR_M, ARM_M
from scenenet.detection.profile import SCRUB_M, Profile, fit_profile

TWIN = 0.35
"""Largest distance between the poles of a portal as a share of the height: poles of 20 m stand up
to 6.4 m apart."""

TWIN_WIDTH_M = 0.6
"""m, largest half width of a pole of a portal."""

TWIN_UPRIGHT, TWIN_FREE = 0.6, 0.3
"""Smallest share of the levels at which the second pole has points, and stands free: a beam and
braces touch it at a third of them, and vegetation at others."""

BEAM, BEAM_SEEN = 0.5, 0.75
"""Share of the height above which there is a beam, and smallest share of its length with points."""

ABOVE_M = 1.5
"""m above the top of the first pole up to which a beam is looked for; the second may be higher."""

STEP_M = 0.2
"""m, distance between the places at which a second pole is looked for."""


def find_twins(
    s: np.ndarray, t: np.ndarray, h: np.ndarray, profile: Profile, height: float
) -> Iterator[tuple[float, bool]]:
    """m to the right of the axis, where the second pole of a portal may stand, and whether a beam
    leads there.

    Args:
        s, t, h: (N,) m, points in the frame of the tower: along the line, to its right, up.
        profile: the first pole, on the axis.
        height: m, of the first pole.
    """
    if profile.foot > TWIN_WIDTH_M:
        return
    for at in _upright_places(s, t, h, profile.level, height):
        # Further away, the first pole may stand more free.
        twin = fit_profile(s, t - at, h, height, TWIN_WIDTH_M / 2)
        if twin is None or max(abs(twin.s), abs(twin.t)) > TWIN_WIDTH_M / 2:
            continue
        place = at + twin.t
        slim_and_free = twin.free >= TWIN_FREE and twin.foot <= TWIN_WIDTH_M
        if slim_and_free:
            yield place, _beam(s, t, h, place, height)


def _upright_places(
    s: np.ndarray, t: np.ndarray, h: np.ndarray, level: float, height: float
) -> np.ndarray:
    """(K,) m across the line, where points are above one another, the most levels first."""
    n_levels = int(height / level)
    n = int(TWIN * height / STEP_M)
    place = np.rint(t / STEP_M).astype(int)
    near = (np.abs(s) <= TWIN_WIDTH_M / 2) & (np.abs(place) <= n)
    near &= (h >= SCRUB_M) & (h < n_levels * level)
    seen = np.zeros((2 * n + 1, n_levels), bool)
    seen[place[near] + n, (h[near] / level).astype(int)] = True
    # A pole and the noise of its points take up two or three places.
    wide = seen.copy()
    wide[1:] |= seen[:-1]
    wide[:-1] |= seen[1:]
    share = wide.mean(axis=1)
    order = np.argsort(-share, kind="stable")
    at = (order - n) * STEP_M
    return at[(share[order] >= TWIN_UPRIGHT) & (np.abs(at) >= 2 * TWIN_WIDTH_M)]


def _beam(s: np.ndarray, t: np.ndarray, h: np.ndarray, at: float, height: float) -> bool:
    """Whether something thin leads across from the axis to a pole ``at`` m beside it."""
    low, high = sorted((0.0, at))
    piece = 0.5
    between = (t > low + piece) & (t < high - piece)
    between &= (h >= BEAM * height) & (h <= height + ABOVE_M)
    n = max(int((high - low - 2 * piece) / piece), 1)
    place = np.minimum((t - low) / piece - 1, n - 1).astype(int)
    beam = between & (np.abs(s) <= ARM_M)
    air = between & (np.abs(s) > 2 * ARM_M) & (np.abs(s) <= 2 * ARM_M + AIR_M)
    thin = beam.sum() / ARM_M > air.sum() / AIR_M
    return bool(thin and len(np.unique(place[beam])) >= BEAM_SEEN * n)
