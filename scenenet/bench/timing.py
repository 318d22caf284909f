"""Medians of interleaved runs, so that a busy moment of the machine affects all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

FAST_MS = 20.0
"""A task faster than this runs a few times before each timed run, so that the other tasks do not
influence the state of caches, threads and memory."""
WARM_RUNS = 3

SLOW_SECONDS = 1.0
"""The first run of a task slower than this counts: start-up costs hardly affect it."""


def medians(
    tasks: Mapping[str, Callable[[], Any]], repetitions: int, most_seconds: float = 20.0
) -> dict[str, float]:
    """Median time of each task, in ms, by name.

    Args:
        tasks: functions to time, by name.
        repetitions: timed runs of each.
        most_seconds: a task that has taken longer in total is not run again; every task runs once.
    """
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for name, task in tasks.items():
        # The first run also compiles, allocates and imports.
        seconds = _seconds(task)
        if seconds > SLOW_SECONDS:
            times[name].append(seconds)
    for _ in range(repetitions):
        for name, task in tasks.items():
            if sum(times[name]) > most_seconds:
                continue
            if not times[name] or times[name][-1] * 1e3 < FAST_MS:
                for _ in range(WARM_RUNS):
                    task()
            times[name].append(_seconds(task))
    return {name: 1e3 * float(np.median(seconds)) for name, seconds in times.items()}


def _seconds(task: Callable[[], Any]) -> float:
    begin = time.perf_counter()
    task()
    return time.perf_counter() - begin
