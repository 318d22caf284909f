"""Confidence intervals of 95 % over seeds."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pandas as pd

CONFIDENCE = 0.95


class Interval(NamedTuple):
    """A statistic with its confidence interval.

    Attributes:
        value: the statistic.
        low, high: ends of the interval; both NaN for a single replicate.
        n: replicates that it comes from, mostly seeds; the fewer of two groups.
    """

    value: float
    low: float
    high: float
    n: int


def mean(values: pd.Series) -> Interval | None:
    """Mean of values (n,), with Student's t; None without any."""
    numbers = values.dropna().to_numpy(float)
    if len(numbers) == 0:
        return None
    value = float(numbers.mean())
    if len(numbers) == 1:
        return Interval(value, math.nan, math.nan, 1)
    return _around(value, float(numbers.var(ddof=1)) / len(numbers), len(numbers) - 1, len(numbers))


def paired(one: pd.Series, other: pd.Series) -> Interval | None:
    """Mean of ``one`` minus ``other``, which have the same seeds as index."""
    return mean((one - other).dropna())


def apart(one: pd.Series, other: pd.Series) -> Interval | None:
    """Mean of ``one`` minus that of ``other``, of different seeds (Welch)."""
    a, b = one.dropna().to_numpy(float), other.dropna().to_numpy(float)
    if not len(a) or not len(b):
        return None
    value, n = float(a.mean() - b.mean()), min(len(a), len(b))
    if n == 1:
        return Interval(value, math.nan, math.nan, 1)
    parts = np.array([a.var(ddof=1) / len(a), b.var(ddof=1) / len(b)])
    square = float(parts.sum())
    if square == 0:
        return Interval(value, value, value, n)
    freedom = square**2 / float((parts**2 / [len(a) - 1, len(b) - 1]).sum())
    return _around(value, square, freedom, n)


def share(hits: pd.Series) -> Interval | None:
    """Share of true values (n,), exact (Clopper and Pearson)."""
    from scipy.stats import beta

    found, n = int(hits.sum()), len(hits)
    if n == 0:
        return None
    tail = (1 - CONFIDENCE) / 2
    low = float(beta.ppf(tail, found, n - found + 1)) if found else 0.0
    high = float(beta.ppf(1 - tail, found + 1, n - found)) if found < n else 1.0
    return Interval(found / n, low, high, n)


def spread_ratio(one: pd.Series, other: pd.Series) -> Interval | None:
    """Standard deviation of ``one`` over that of ``other`` (F distribution)."""
    from scipy.stats import f

    a, b = one.dropna(), other.dropna()
    if len(a) < 2 or len(b) < 2 or not b.std():
        return None
    ratio, tail = float(a.var() / b.var()), (1 - CONFIDENCE) / 2
    low, high = (ratio / float(f.ppf(q, len(a) - 1, len(b) - 1)) for q in (1 - tail, tail))
    return Interval(math.sqrt(ratio), math.sqrt(low), math.sqrt(high), min(len(a), len(b)))


def _around(value: float, square: float, freedom: float, n: int) -> Interval:
    """The interval around a value with the squared standard error ``square``."""
    from scipy.stats import t

    half = float(t.ppf((1 + CONFIDENCE) / 2, freedom)) * math.sqrt(square)
    return Interval(value, value - half, value + half, n)
