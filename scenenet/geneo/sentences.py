"""Helpers for sentences that describe the parameters of a kernel (thesis 5.2.2)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

Numbers = Mapping[str, float]
"""The parameters of one kernel by name, in m, m^2 or without unit."""


class Reference(NamedTuple):
    """Lengths that the sentences compare with.

    Attributes:
        step: m, vertical step of the kernel: edge of the training voxels, or one metre.
        tower_width: m, mean over the labelled towers; None if it was not measured.
    """

    step: float = 1.0
    tower_width: float | None = None


Sentence = Callable[[Numbers, Reference], str]
"""Describes the value of a parameter, given all parameters of its kernel."""


HALF = math.sqrt(2 * math.log(2))
"""Value of |d^2 - r^2| / sigma at which a shell is half as high as at its radius."""


def m(length: float) -> str:
    """A length in m with its unit, to two significant digits or so."""
    return f"{length:.1f} m" if length >= 0.95 else f"{length:.2f} m"


def shell(radius: float, sigma: float) -> tuple[float, float]:
    """Distances between which exp(-(d^2 - r^2)^2 / (2 sigma^2)) is at least one half, m."""
    reach = HALF * abs(sigma)
    return math.sqrt(max(radius**2 - reach, 0.0)), math.sqrt(radius**2 + reach)


def shell_width(n: Numbers, centre: str, subtracted: str) -> str:
    """Describes sigma: where a shell around ``centre`` has at least half its highest weight.

    Args:
        n: with ``r`` and ``sigma``.
        subtracted: what the kernel subtracts from the shell.
    """
    inner, outer = shell(n["r"], n["sigma"])
    where = f"within {m(outer)} of" if inner == 0 else f"{m(inner)} to {m(outer)} from"
    return (
        f"points {where} {centre} have at least half the highest weight, before {subtracted} is "
        "subtracted"
    )


def body_radius(n: Numbers, reference: Reference) -> str:
    """Describes the radius ``r`` of a tower's body."""
    width = 2 * abs(n["r"])
    known = reference.tower_width
    share = f", {width / known:.0%} of the mean width of a labelled tower," if known else ""
    return f"a column {m(width)} wide{share} gives the strongest response"
