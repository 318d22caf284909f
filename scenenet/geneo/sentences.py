"""Helpers for the sentences that say in words what a kernel's parameters mean."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

Numbers = Mapping[str, float]
"""The parameters of one kernel by their symbol, in metres, square metres or without unit."""


class Surroundings(NamedTuple):
    """What a length is put beside.

    Attributes:
        step: m, what a kernel's height is counted in: the voxel it was trained on, or a metre.
        tower_width: m, mean over the labelled towers; None where nobody measured them.
    """

    step: float = 1.0
    tower_width: float | None = None


ALONE = Surroundings()

Sentence = Callable[[Numbers, Surroundings], str]
"""What the value of a parameter means, in words."""


HALF = math.sqrt(2 * math.log(2))
"""A shell is at half its height where |d^2 - r^2| is so many sigma."""


def m(length: float) -> str:
    return f"{length:.1f} m" if length >= 0.95 else f"{length:.2f} m"


def shell(radius: float, sigma: float) -> tuple[float, float]:
    """Distances between which exp(-(d^2 - r^2)^2 / (2 sigma^2)) is at least one half, m."""
    reach = HALF * abs(sigma)
    return math.sqrt(max(radius**2 - reach, 0.0)), math.sqrt(radius**2 + reach)


def between(inner: float, outer: float, of: str) -> str:
    return f"within {m(outer)} of {of}" if inner == 0 else f"{m(inner)} to {m(outer)} from {of}"


def body_radius(n: Numbers, beside: Surroundings) -> str:
    width = 2 * abs(n["r"])
    known = beside.tower_width
    share = f", {width / known:.0%} of the mean width of a labelled tower," if known else ""
    return f"a column {m(width)} wide{share} speaks most for a tower"
