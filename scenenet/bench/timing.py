"""Medians of runs that take turns, so that a busy moment of the machine meets all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

FAST_MS = 20.0
"""What takes less is run some times before each timed run: caches, threads and memory are then as
they are in the middle of work, and not as another way left them."""
WARM_RUNS = 3

SLOW_SECONDS = 1.0
"""From here on the first run of a way is as good as any."""


def medians(
    ways: Mapping[str, Callable[[], Any]], repetitions: int, most_seconds: float = 20.0
) -> dict[str, float]:
    """Median time of each way, in ms.

    Args:
        ways: what to run, by name.
        repetitions: timed runs of each.
        most_seconds: a way that has used up so much is not run again; it has run once at least.

    Returns:
        by the same names.
    """
    times: dict[str, list[float]] = {name: [] for name in ways}
    for name, way in ways.items():
        # The first run compiles, allocates and imports; it counts only where that is nothing to it.
        seconds = _seconds(way)
        if seconds > SLOW_SECONDS:
            times[name].append(seconds)
    for _ in range(repetitions):
        for name, way in ways.items():
            if sum(times[name]) > most_seconds:
                continue
            if not times[name] or times[name][-1] * 1e3 < FAST_MS:
                for _ in range(WARM_RUNS):
                    way()
            times[name].append(_seconds(way))
    return {name: 1e3 * float(np.median(seconds)) for name, seconds in times.items()}


def _seconds(way: Callable[[], Any]) -> float:
    begin = time.perf_counter()
    way()
    return time.perf_counter() - begin
