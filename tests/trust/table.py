"""What the trust suite tried and what was lost, as a table."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Attempt:
    """One attempt to lose something.

    Attributes:
        number: its number within its subject; with the seed it repeats the attempt.
        what: what was tried.
        lost: what was lost; None if nothing was.
    """

    number: int
    what: str
    lost: str | None = None


@dataclass(frozen=True)
class Skipped:
    """A part that cannot run on this machine."""

    reason: str


@dataclass(frozen=True)
class Subject:
    """A kind of attempts.

    Attributes:
        name: for the table and for ``--only``.
        tries: a function that takes an empty folder, a seed and the numbers to try, and yields the
            attempts.
        count: number of attempts of a full run.
        one_by_one: whether an attempt can be repeated without the others.
    """

    name: str
    tries: Callable[[Path, int, Sequence[int]], Iterator[Attempt | Skipped]]
    count: int
    one_by_one: bool = True


@dataclass
class Tally:
    """The attempts of a subject so far."""

    subject: Subject
    seed: int
    tried: int = 0
    lost: list[str] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def survived(self) -> int:
        return self.tried - len(self.lost)

    def add(self, attempt: Attempt | Skipped) -> None:
        if isinstance(attempt, Skipped):
            self.skipped.append(f"{self.subject.name}: skipped: {attempt.reason}")
            return
        self.tried += 1
        if attempt.lost is not None:
            self.lost.append(
                f"{self.subject.name} {attempt.number}: {attempt.what}: {attempt.lost}\n"
                f"    repeat: {self._repeat(attempt.number)}"
            )

    def _repeat(self, number: int) -> str:
        one = f" --number {number}" if self.subject.one_by_one else ""
        only = f"--only '{self.subject.name}' --seed {self.seed}{one}"
        return f"PYTHONPATH=tests python -m trust {only}"


def run(subject: Subject, folder: Path, seed: int, numbers: Sequence[int] | None = None) -> Tally:
    """Make the attempts of a subject in an empty folder; by default all of a full run."""
    tally = Tally(subject, seed)
    folder.mkdir(parents=True)
    started = time.perf_counter()
    chosen = range(subject.count) if numbers is None else numbers
    for attempt in subject.tries(folder, seed, chosen):
        tally.add(attempt)
    tally.seconds = time.perf_counter() - started
    return tally


def table(tallies: Sequence[Tally]) -> str:
    """One line a subject, and a line of sums."""
    rows = [("subject", "tried", "survived", "lost", "seconds")]
    for t in tallies:
        rows.append(_row(t.subject.name, [t]))
    rows.append(_row("total", tallies))
    width = max(len(row[0]) for row in rows)
    return "\n".join(
        f"{name:<{width}}" + "".join(f"{cell:>10}" for cell in cells) for name, *cells in rows
    )


def _row(name: str, tallies: Sequence[Tally]) -> tuple[str, ...]:
    numbers = (
        sum(t.tried for t in tallies),
        sum(t.survived for t in tallies),
        sum(len(t.lost) for t in tallies),
        round(sum(t.seconds for t in tallies)),
    )
    return (name, *map(str, numbers))
