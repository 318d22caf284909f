"""What the training data say about each number of a SCENE-Net in metres."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from scenenet.core.settings import Settings

Source = Literal["points", "score", "fixed"]

WITHIN = 0.3
"""Largest deviation of a number that counts as determined, as a share of its value."""


class Evidence(Settings):
    """Where a number comes from, and between which values it may lie."""

    source: Source = Field(
        description="points: measured at the labelled towers; score: found by the search for F0.5; "
        "fixed: neither"
    )
    low: float = Field(
        description="lowest value that the data allow: two standard errors below the measurement, "
        "or the score within 0.01 of the best with the other numbers kept"
    )
    high: float = Field(description="highest such value")
    at_bound: bool = Field(description="whether the number lies at a bound of its range")
    determined: bool = Field(
        description="whether low and high lie within 30 % of the number, which is at no bound"
    )

    @classmethod
    def of(
        cls, source: Source, value: float, between: tuple[float, float], bounds: tuple[float, float]
    ) -> Evidence:
        """The evidence for a ``value``, given the values ``between`` which it may lie and the
        ``bounds`` of its range, all positive."""
        low, high = between
        at_bound = not bounds[0] * 1.02 < value < bounds[1] / 1.02
        close = low >= (1 - WITHIN) * value and high <= (1 + WITHIN) * value
        return cls(
            source=source,
            low=low,
            high=high,
            at_bound=at_bound,
            determined=source != "fixed" and close and not at_bound,
        )
