"""Progress of long work, on stderr: a bar on a terminal, a line every few seconds in a log."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterable, Iterator, Sized
from contextvars import ContextVar
from typing import TypeVar

Item = TypeVar("Item")

LOG_INTERVAL_S = 5.0
"""Seconds between two lines if stderr is a file, so that a log stays readable."""


_QUIET: ContextVar[bool] = ContextVar("quiet", default=False)


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Report no progress within the block, which is one step of work that reports its own."""
    token = _QUIET.set(True)
    try:
        yield
    finally:
        _QUIET.reset(token)


def track(items: Iterable[Item], label: str, total: int | None = None) -> Iterator[Item]:
    """Yield ``items`` and report progress on stderr.

    Args:
        items: what to iterate over.
        label: text before the count.
        total: number of items; needed only if ``items`` has no length.
    """
    if total is None and isinstance(items, Sized):
        total = len(items)
    if _QUIET.get():
        yield from items
        return
    if sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import track as rich_track

        console = Console(stderr=True)
        yield from rich_track(items, description=label, total=total, console=console)
        return
    of_total = "" if total is None else f"/{total}"
    start = last = time.monotonic()
    done = 0
    for done, item in enumerate(items, start=1):
        yield item
        now = time.monotonic()
        if now - last >= LOG_INTERVAL_S:
            left = 0.0 if total is None else (now - start) / done * (total - done)
            text = f", about {_duration(left)} left" if left > 0 else ""
            print(f"{label}: {done}{of_total}{text}", file=sys.stderr, flush=True)
            last = now
    print(f"{label}: done ({done})", file=sys.stderr, flush=True)


def track_if(items: Iterable[Item], label: str | None) -> Iterable[Item]:
    """``items``, with their progress if there is a label."""
    return items if label is None else track(items, label)


def labelled(start: str | None, what: str) -> str | None:
    """The label of a stage of work; None if no progress is shown."""
    return None if start is None else f"{start}: {what}"


def _duration(seconds: float) -> str:
    """A time in the unit in which it is a number of one or two digits."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{max(seconds, 1.0):.0f} s"
