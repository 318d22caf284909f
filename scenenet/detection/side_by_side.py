"""Two poles side by side across the line: one portal, or a tower each.

Between the poles of a portal is a beam, which holds a conductor midway and others outside both
poles. Two towers have air between them, because the conductors of each need it. Where conductors
lead from one to the other, as to a line that branches off, they look like beams, one above another;
but each of the two poles holds conductors of its own at several heights.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenenet.detection.conductor_rules import LEVEL_M
from scenenet.detection.conductors import Span
from scenenet.detection.line_frame import across, unit

CLOSE = 0.25
"""Largest distance from a pole to a conductor of its own, as a share of the distance to the other
pole: it is nearer to its pole than to the middle. The conductors of a portal hang from its beam,
about midway and as far outside."""

OWN_LEVELS = 2
"""Smallest number of heights, at least ``LEVEL_M`` apart, at which a pole beside another has
conductors of its own. A portal has all on its beam, and an earth wire on each pole."""

MIDWAY = 0.125
"""Largest distance of a conductor from the middle between two poles, and smallest distance outside
them, as a share of the distance between them."""


def stand_apart(one: Sequence[Span], other: Sequence[Span], apart: float) -> bool:
    """Whether each of two poles holds conductors of its own at several heights.

    Args:
        one, other: the conductors at each, relative to its axis.
        apart: m between them.
    """
    return min(_levels(one, CLOSE * apart), _levels(other, CLOSE * apart)) >= OWN_LEVELS


def hold_together(
    one: Sequence[Span], other: Sequence[Span], along: np.ndarray, away: float
) -> bool:
    """Whether two poles hold a conductor midway between them, and others outside both.

    Args:
        one, other: the conductors at each, relative to its axis.
        along: (2,) unit vector along the line.
        away: m to the right from the first pole to the other.
    """
    # Seen from each pole, the other is on the positive side.
    first = np.sign(away) * _right(one, along)
    second = -np.sign(away) * _right(other, along)
    apart = abs(away)
    outside = all((side < -MIDWAY * apart).any() for side in (first, second))
    midway = any((np.abs(side - apart / 2) <= MIDWAY * apart).any() for side in (first, second))
    return outside and midway


def _levels(spans: Sequence[Span], within: float) -> int:
    """Number of heights at which conductors pass an axis within a distance in m."""
    passes = np.concatenate([np.empty((0, 2)), *(span.passes for span in spans)])
    number, last = 0, -np.inf
    for height in np.sort(passes[np.abs(passes[:, 0]) <= within, 1]):
        if height - last >= LEVEL_M:
            number, last = number + 1, height
    return number


def _right(spans: Sequence[Span], along: np.ndarray) -> np.ndarray:
    """(K,) m to the right of a line along which conductors pass an axis."""
    sides = [np.empty(0)]
    for span in spans:
        turned = float(across(unit(span.bearing)) @ across(along))
        if abs(turned) > np.cos(np.radians(45.0)):
            sides.append(np.sign(turned) * span.passes[:, 0])
    return np.concatenate(sides)
