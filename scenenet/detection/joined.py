"""Bodies that a beam joins: the legs and the window of one tower.

The axis of a window tower may be found amid its conductors and on both sides of its window. All of
these stand in one plane across the line, and members of the tower lead from each to the next. Two
towers side by side have free air between them, because the conductors of each need it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scenenet.detection.conductor_rules import POLE_M
from scenenet.detection.head import AIR_M, FREE
from scenenet.detection.line_frame import across, line_frame, sides_of
from scenenet.detection.portal import BEAM
from scenenet.detection.side_by_side import hold_together, stand_apart
from scenenet.detection.structure import Structure
from scenenet.detection.surroundings import Surroundings

PLANE_M = 1.0
"""m along the line between the bodies of one tower, and half the depth of a beam between them."""

REACH = 0.45
"""Largest distance between two bodies of a tower as a share of its height; the bridge of a window
tower is nearly as wide as half its height."""

LEGS = 0.27
"""Smallest distance between the two legs of a window tower, where its window is widest, as a share
of its height. From its axis to a leg it is about a fifth."""

PIECE_M, SEEN = 0.5, 0.9
"""m, length of the pieces of a beam, and smallest share of them with a point. Between the crossarms
of two towers is more free air than one piece."""


def joined(one: Structure, other: Structure, points: Surroundings) -> bool:
    """Whether two bodies belong to one tower: a beam leads from one to the other, as seen from
    either, or conductors show that there is one.

    Args:
        points: gives the points around a position.
    """
    if one.apart or other.apart:
        return _is_pole_of(one, other) or _is_pole_of(other, one)
    if max(one.profile.width, other.profile.width) <= POLE_M:
        if _hold_together(one, other) or _hold_together(other, one):
            return True
        apart = float(np.hypot(one.x - other.x, one.y - other.y))
        if stand_apart(one.spans, other.spans, apart):
            return False
    return _leads(one, other, points) or _leads(other, one, points)


def _hold_together(one: Structure, other: Structure) -> bool:
    """Whether two poles in the plane of the first hold their conductors together."""
    away = _across(one, other)
    if away is None or abs(away) > REACH * max(one.height, other.height):
        return False
    return hold_together(one.spans, other.spans, one.along, away)


def _is_pole_of(portal: Structure, other: Structure) -> bool:
    """Whether a body is one of the two of a portal."""
    away = _across(portal, other)
    return away is not None and abs(abs(away) - portal.apart) <= PLANE_M


def _leads(one: Structure, other: Structure, points: Surroundings) -> bool:
    """Whether a beam in the plane of the first leads to the other."""
    away = _across(one, other)
    tall = max(one.height, other.height)
    if away is None or abs(away) > REACH * tall:
        return False
    place = np.array([one.x, one.y])
    near = points(place, float(np.hypot(abs(away), PLANE_M + AIR_M)))
    s, t, h = line_frame(near, place, one.along, one.ground.level)
    head = (h >= BEAM * tall) & (h <= tall)
    t = t[head] * np.sign(away)
    s = np.abs(s[head])
    low, high = one.profile.top, abs(away) - other.profile.top
    n = int((high - low) / PIECE_M)
    if n < 1:
        return True
    piece = np.floor((t - low) / PIECE_M).astype(int)
    between = (piece >= 0) & (piece < n)
    beam = between & (s <= PLANE_M)
    air = between & (s > PLANE_M) & (s <= PLANE_M + AIR_M)
    thin = beam.sum() / PLANE_M > FREE * air.sum() / AIR_M
    return bool(thin and len(np.unique(piece[beam])) >= SEEN * n)


def _across(one: Structure, other: Structure) -> float | None:
    """m to the right of one body to the other; None if they are not in one plane."""
    offset = np.array([other.x - one.x, other.y - one.y])
    right = across(one.along)
    return float(offset @ right) if abs(offset @ one.along) <= PLANE_M else None


def tower_of(bodies: Sequence[Structure]) -> Structure:
    """The tower that joined bodies belong to.

    It is the body that was found amid the conductors, or else the one that is nearest to the middle
    of conductors and crossarms: from a leg not all conductors are seen, and crowns look like
    crossarms. Two legs without one between them are the two bodies of a portal, and so are two
    poles.
    """
    for body in bodies:
        if body.apart:
            return body
    bodies = [body for body in bodies if body.amid] or bodies
    first = bodies[0]
    right = across(first.along)
    at = [float(np.array([b.x - first.x, b.y - first.y]) @ right) for b in bodies]
    poles = max(body.profile.width for body in bodies) <= POLE_M
    if len(bodies) == 2 and (poles or abs(at[1]) > LEGS * first.height):
        return _portal(first, bodies[1], at[1])
    passes = [
        place + side
        for body, place in zip(bodies, at, strict=True)
        for side in (0.0, *sides_of(body.spans, first.along), *_extent(body, first.along))
    ]
    middle = (min(passes) + max(passes)) / 2
    return bodies[int(np.argmin([abs(place - middle) for place in at]))]


def _extent(body: Structure, along: np.ndarray) -> list[float]:
    """m, ends of the crossarms of a body to the right of it, seen ``along`` (2,)."""
    turned = float(np.sign(body.along @ along))
    return [turned * end for end in body.head.extent]


def _portal(one: Structure, other: Structure, away: float) -> Structure:
    """Two legs as one tower, with its axis between them; the second is ``away`` m to the right."""
    half = away / 2 * across(one.along)
    rise = float(one.ground.slope @ half)
    ground = replace(one.ground, elevation=one.ground.elevation + rise)
    head = replace(one.head, left=one.head.left - away / 2)
    x, y = one.x + float(half[0]), one.y + float(half[1])
    tall = one.height - rise
    return replace(one, x=x, y=y, ground=ground, height=tall, head=head, apart=abs(away) / 2)
