"""Measures the structure of a tower in the points around an approximate axis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from scenenet.detection.conductor_rules import WINDOW_M
from scenenet.detection.conductors import Span
from scenenet.detection.ground import fit_ground
from scenenet.detection.head import NO_HEAD, find_head
from scenenet.detection.joined import LEGS
from scenenet.detection.line_frame import (
    across,
    direction_of,
    line_frame,
    middle_of,
    rise,
    sides_of,
    unit,
)
from scenenet.detection.portal import find_twins
from scenenet.detection.profile import (
    FORK,
    GAP_M,
    SCRUB_M,
    SHIFT_M,
    Profile,
    fit_profile,
    furthest,
)
from scenenet.detection.side_by_side import hold_together, stand_apart
from scenenet.detection.structure import MARGIN_M, BodyTests, Structure

FOOT_M = 0.5
"""m above the ground below which the foot of a tower looks like grass and scrub."""

SCRUB_TOP_M, SCRUB_TOP = 3.0, 0.15
"""Height of the highest scrub around a foot: m, and as a share of the height of the body. Below a
tall tower it may grow higher, because there is more clearance."""

BELOW_ARM = 0.08
"""Share of the height below the lowest conductor at which struts of a crossarm may start."""

PEAK_M = 1.5
"""m above the highest conductor that the top of a tower may be."""

SPARSE = 0.8
"""Share of the height in voxels up to which conductors are looked for at least."""

POINTS_PER_M = 0.7
"""Smallest number of points of a body per m of its height. Fewer show no body; the corner of a
facade may have them."""

UPRIGHT_M = 1.5
"""m, smallest height of the levels in which a body has to be unbroken."""

TOP_GAP = 3.0
"""m without a point that end a body upwards, so that a bird above it is not its top."""

AMID_SHIFT_M = 1.0
"""m, largest distance of the axis of a window tower from the middle of its conductors, where they
leave in two directions. Further away is one of its legs."""

UNDER_BEAM_M = 1.0
"""m, smallest distance of a conductor in a window below the top of the body, which is the beam that
it hangs from."""

Leaving = Callable[[np.ndarray, float, float, float], Sequence[Span]]
"""The conductors that leave a tower, from its axis (2,), the elevation of its foot, its height, and
the largest distance at which a conductor passes the axis, m."""


def measure_structure(
    points: np.ndarray,
    leaving: Leaving,
    axis: np.ndarray,
    base: float,
    height: float,
    crossarm: float,
    tests: BodyTests,
    amid: bool,
) -> Structure | None:
    """The structure at an approximate axis, or None where no body stands free.

    Args:
        points: (N, 3) m, within ``candidates.SURROUNDINGS_M`` of the axis in plan.
        leaving: gives the conductors; only asked for where it matters.
        axis: (2,) m, approximate.
        base, height: m, elevation of the foot and height above it, approximate.
        crossarm: m, largest distance at which a conductor passes the axis.
        tests: what a body has to be; conductors are only looked for where it is.
        amid: whether the axis is looked for amid the conductors and not where it is thought to be.
    """
    first = None if amid else _measure_body(points, axis, direction_of(()), height)
    if first is None and not amid:
        return None
    if first is not None:
        if not tests.passed(first):
            return None
        axis, base = np.array([first.x, first.y]), first.ground.elevation
    # Few returns may leave a gap below the head, which the conductors then show.
    top = height if first is None else max(first.height, SPARSE * height)
    spans = tuple(leaving(axis, base, top, crossarm))
    # Now the direction of the line is known.
    if amid:
        if not spans:
            return None
        # From there, conductors show on both sides.
        axis = axis + middle_of(spans)
        spans = tuple(leaving(axis, base, top, crossarm))
        sides = sides_of(spans, direction_of(spans))
        if not spans or max(sides) - min(sides) < WINDOW_M:
            return None
    start = axis + middle_of(spans) if amid else axis
    tall = height if first is None else first.height + 1
    shift = AMID_SHIFT_M if amid and len(spans) > 1 else SHIFT_M
    body = _measure_body(points, start, direction_of(spans), tall, shift)
    if body is None or not (tests.passed(body) or (amid and tests.passed_below_window(body))):
        return None
    # The frame of the spans is the axis at which they were looked for.
    place = np.array([body.x, body.y, body.ground.elevation])
    spans = tuple(span.passes_of(place - [*axis, base]) for span in spans)

    def beside(away: np.ndarray) -> tuple[Span, ...]:
        return tuple(leaving(place[:2] + away, base, top, crossarm))

    whole = _with_head(_with_twin(body, points, spans, beside), points, spans, axis)
    return replace(whole, amid=amid) if tests.passed(body) or _has_window(whole) else None


def _has_window(tower: Structure) -> bool:
    """Whether a conductor passes below the top of a tower, nearer to its axis than legs of a window
    are, under crossarms that reach as far to both sides."""
    if not tower.head.is_even(tower.profile.width / 2):
        return False
    passes = np.concatenate([np.empty((0, 2)), *(span.passes for span in tower.spans)])
    through = np.abs(passes[:, 0]) < LEGS / 2 * tower.height
    return bool((passes[through, 1] <= tower.body_top - UNDER_BEAM_M).any())


def _measure_body(
    points: np.ndarray, axis: np.ndarray, along: np.ndarray, height: float, shift: float = SHIFT_M
) -> Structure | None:
    """The body near an axis, without crossarms and conductors."""
    points = _around(points, axis, np.sqrt(2) * furthest(height))
    if len(points) == 0:
        return None
    s, t, h = line_frame(points, axis, along, fit_ground(points, axis))
    profile = fit_profile(s, t, h, height, shift)
    if profile is None:
        return None
    axis = axis + profile.s * along + profile.t * across(along)
    profile = replace(profile, s=0.0, t=0.0)
    ground = fit_ground(points, axis)
    s, t, h = line_frame(points, axis, along, ground, FOOT_M)
    half = profile.half_width(h) + MARGIN_M
    inside = np.maximum(np.abs(s), np.abs(t)) <= half
    foot = _foot(s, t, h, profile, height)
    level = h + rise(s, t, along, ground)
    of_body = level[inside & (h >= foot)]
    top, upright = _top(of_body, height, profile.level, foot)
    if top is None or (of_body <= top).sum() < POINTS_PER_M * (top - foot):
        return None
    x, y = axis.tolist()
    return Structure(x, y, ground, top, foot, along, profile, upright, NO_HEAD, ())


def _with_twin(
    body: Structure,
    points: np.ndarray,
    spans: tuple[Span, ...],
    beside: Callable[[np.ndarray], tuple[Span, ...]],
) -> Structure:
    """The body, or both bodies of a portal.

    Args:
        spans: the conductors at the body.
        beside: gives those at a place (2,) m from it.
    """
    axis = np.array([body.x, body.y])
    s, t, h = line_frame(points, axis, body.along, body.ground, SCRUB_M)
    for at, beam in find_twins(s, t, h, body.profile, body.height):
        others = beside(at * across(body.along))
        if hold_together(spans, others, body.along, at):
            break
        if beam and not stand_apart(spans, others, abs(at)):
            break
    else:
        return body
    away = at / 2 * across(body.along)
    x, y = (axis + away).tolist()
    ground = fit_ground(points, np.array([x, y]))
    top = body.height + body.ground.elevation
    return replace(body, x=x, y=y, ground=ground, apart=abs(at) / 2, height=top - ground.elevation)


def _with_head(
    body: Structure, points: np.ndarray, spans: tuple[Span, ...], origin: np.ndarray
) -> Structure:
    """The body with its crossarms, which the conductors show.

    Args:
        origin: (2,) m, the axis that the spans are relative to.
    """
    right = across(body.along)
    moved = float((origin - np.array([body.x, body.y])) @ right)
    body = replace(body, spans=spans, body_top=body.height)
    line = tuple(
        span
        for span in body.spans
        if abs(unit(span.bearing) @ body.along) > np.cos(np.radians(45.0))
    )
    if not line:
        return body
    sides = [side + moved for side in sides_of(line, body.along)]
    lowest = min(span.lowest for span in line) - BELOW_ARM * body.height
    lowest = max(lowest, body.height / 2)
    highest = max(body.height, *(span.highest for span in line))
    reach = max(abs(side) for side in sides)
    from_fork = min(lowest, FORK * body.height)
    place, level = np.array([body.x, body.y]), body.ground.level
    s, t, h = line_frame(points, place, body.along, level, from_fork)
    head = find_head(s, t, h, body.profile, body.apart, lowest, highest, reach)
    shape = replace(body, head=head, height=highest + PEAK_M)
    top = max(body.height, float(h[head.covers(t, h) & (np.abs(s) <= head.thick)].max(initial=0.0)))
    return replace(shape, height=top)


def _around(points: np.ndarray, axis: np.ndarray, radius: float) -> np.ndarray:
    """The points (N, 3) m in a square of twice ``radius`` m about an axis (2,) m, (M, 3)."""
    near = np.abs(points[:, 0] - axis[0]) <= radius
    near &= np.abs(points[:, 1] - axis[1]) <= radius
    return points.T[:, np.flatnonzero(near)].T


def _foot(s: np.ndarray, t: np.ndarray, h: np.ndarray, profile: Profile, height: float) -> float:
    """m above the ground up to which vegetation is as dense around the body as in it."""
    half = profile.half_width(h) + MARGIN_M
    distance = np.maximum(np.abs(s), np.abs(t))
    levels = np.arange(FOOT_M, max(SCRUB_TOP_M, SCRUB_TOP * height), FOOT_M)
    foot = FOOT_M
    for level in levels:
        at = (h >= level) & (h < level + FOOT_M)
        inside = (at & (distance <= half)).sum()
        around = (at & (distance > half) & (distance <= half + GAP_M)).sum()
        width = float(profile.half_width(np.array([level]))[0]) + MARGIN_M
        areas = width**2 / ((width + GAP_M) ** 2 - width**2)
        if 2 * around * areas > inside:
            foot = float(level + FOOT_M)
    return foot


def _top(h: np.ndarray, height: float, level: float, foot: float) -> tuple[float | None, float]:
    """Height of the top in m, and the share of the levels between ``foot`` and it with a point.

    Args:
        h: (N,) m above the ground, points of the body from ``foot`` upwards.
        height: m, approximate.
        level: m, height of the levels in which a gap is looked for.
    """
    if len(h) == 0:
        return None, 0.0
    levels = np.unique(np.floor(h / level).astype(int))
    start = levels[np.argmin(np.abs(levels - height / (2 * level)))]
    above = levels[levels >= start]
    breaks = np.flatnonzero(np.diff(above) > max(TOP_GAP / level, 1))
    last = above[breaks[0]] if len(breaks) else above[-1]
    top = float(h[np.floor(h / level).astype(int) <= last].max())
    tall = max(level, UPRIGHT_M)
    below = h[h <= top]
    n_levels = max(int(np.ceil((top - foot) / tall)), 1)
    seen = np.unique(np.minimum(((below - foot) / tall).astype(int), n_levels - 1))
    return top, len(seen) / n_levels
