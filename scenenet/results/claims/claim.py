"""A claim of the thesis, and the rule of its verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import pandas as pd

from scenenet.results.claims.evidence import Evidence
from scenenet.results.claims.intervals import Interval

HOLDS, NOT, OPEN = "holds", "does not hold", "cannot be told"
VERDICTS = (HOLDS, NOT, OPEN)

POSITIVE, NEGATIVE = (math.ulp(0.0), math.inf), (-math.inf, -math.ulp(0.0))
"""Where a statistic lies that is said to be above or below 0."""
EQUAL = 0.05
"""Scores that differ by less are equal: the spread over seeds in the thesis is up to 0.08."""
NOTHING = (0.0, 0.005)
"""Where a score lies that Table 5.5 prints as 0.00."""


def about(size: float) -> tuple[float, float]:
    """Where an effect of a published size lies: between half and twice of it."""
    return (size / 2, size * 2) if size > 0 else (size * 2, size / 2)


@dataclass(frozen=True)
class Claim:
    """A claim of chapter 5.

    Attributes:
        name: key in the table.
        place: section, table or figure of the thesis.
        says: the claim as a sentence, with the effect that it asserts.
        statistic: what is measured.
        asserted: least and greatest value of the statistic for which the claim is true.
        measure: the statistic of a run with its interval; None where it was not measured.
        skilled: F0.5 by seed of the models that must detect towers for the claim to mean anything,
            by what they are; a model without skill proves nothing about skill. Empty for claims
            about times, starts and labels.
        study: study that the claim is about; its findings explain a claim that does not hold. None
            for none.
        timed: whether it is about times, which differ between two equal runs.
    """

    name: str
    place: str
    says: str
    statistic: str
    asserted: tuple[float, float]
    measure: Callable[[Evidence], Interval | None]
    skilled: Sequence[tuple[str, Callable[[Evidence], pd.Series]]] = ()
    study: str | None = None
    timed: bool = False


class Judged(NamedTuple):
    """A claim with what a run says about it; ``remark`` says why it cannot be told, or what was
    found instead."""

    claim: Claim
    found: Interval | None
    verdict: str
    remark: str


def judge(claim: Claim, evidence: Evidence) -> Judged:
    """Whether a claim holds in a run.

    It holds if the whole interval lies where the claim asserts, does not hold if no part of it
    does, and cannot be told otherwise.
    """
    found = claim.measure(evidence)
    if found is None:
        if claim.study is not None and not evidence.has_study(claim.study):
            return Judged(claim, None, OPEN, f"This run has no study {claim.study}.")
        needed = " and ".join(what for what, _ in claim.skilled)
        seen = f", or no seed of {needed} detects anything" if needed else ""
        return Judged(claim, None, OPEN, f"Not measured in this run{seen}.")
    for what, scores in claim.skilled:
        if (lack := evidence.lack_of_skill(scores(evidence))) is not None:
            return Judged(claim, found, OPEN, f"{what[:1].upper()}{what[1:]} {lack}.")
    if found.n < 2:
        return Judged(claim, found, OPEN, "A single seed has no interval.")
    low, high = claim.asserted
    if low <= found.low and found.high <= high:
        return Judged(claim, found, HOLDS, "")
    if found.high < low or high < found.low:
        return Judged(claim, found, NOT, evidence.findings(claim.study))
    return Judged(claim, found, OPEN, "The interval reaches beyond what the claim asserts.")
