"""A full disk: a message, no traceback, and nothing under the name of the result.

By a limit on the size of files, which works everywhere, and on a small disk in memory, where
mounting is permitted.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from trust.originals import write_pole_model, write_survey
from trust.processes import (
    Ended,
    end_of,
    files_in,
    fill_disk,
    has,
    must,
    predict,
    scenenet,
    small_disk,
    start,
    wait_for,
)
from trust.table import Attempt, Skipped, Subject

LIMITS = {
    "predict": (0, 1000, 20_000, 100_000),
    "synth": (0, 1000, 100_000, 500_000),
    "train": (0, 100, 1000),
}
"""Command -> bytes that a file may have."""
FREE = {"predict": (0, 8192, 200_000), "synth": (0, 8192, 200_000), "train": (0,)}
"""Command -> bytes that are free on the disk of the results."""
DISK_BYTES = 16 * 2**20

LIMIT_CASES = [(command, limit) for command, limits in LIMITS.items() for limit in limits]
DISK_CASES = [
    *((command, "results", free) for command, free_ones in FREE.items() for free in free_ones),
    ("predict", "temporary files", 0),
    ("predict", "temporary files", 8192),
    ("train", "temporary files", 0),
    ("predict", "results, filled while it runs", DISK_BYTES),
    ("predict", "temporary files, filled while it runs", DISK_BYTES),
]


class _Commands:
    """The three commands that write, with their inputs, and what each of them writes."""

    def __init__(self, folder: Path) -> None:
        self.survey, self.model = folder / "line.laz", folder / "model.json"
        write_survey(self.survey, poles=4)
        write_pole_model(self.model)

    def call(self, command: str, out: Path) -> tuple[object, ...]:
        if command == "predict":
            return predict(self.survey, self.model, out)
        if command == "synth":
            return (command, out / "made.laz", "--towers", 2)
        options = ("--resolution", 32, "--protocol", "thesis", "--epochs", 1, "--seeds", 1)
        return (command, self.survey, "--codes", "edp", "--out", out / "made.json", *options)

    def warm_up(self, folder: Path, commands: set[str]) -> None:
        """Run them once without a limit: compiled code is cached then."""
        for command in sorted(commands):
            must(*self.call(command, folder / command))
            if not files_in(folder / command):
                raise RuntimeError(f"{command} writes nothing")


def _fault(done: Ended, out: Path, ignored: str = "") -> str | None:
    if done.fault is not None:
        return done.fault
    left = [name for name in files_in(out) if name != ignored]
    if done.code == 1 and left:
        return f"it failed and left {', '.join(left)}"
    if done.code == 0 and not left:
        return "exit code 0 without a result"
    return None


def _with_limit(folder: Path, seed: int, numbers: Sequence[int]) -> Iterator[Attempt]:
    commands = _Commands(folder)
    commands.warm_up(folder / "warm", {LIMIT_CASES[number][0] for number in numbers})
    for number in numbers:
        command, limit = LIMIT_CASES[number]
        out = folder / str(number)
        done = scenenet(*commands.call(command, out), tmp=folder / "tmp", max_file=limit)
        lost = _fault(done, out)
        if lost is None and done.code == 0:
            lost = "the limit was not reached: the suite has to lower it"
        if lost is None and files_in(folder / "tmp"):
            lost = "temporary files stay"
        yield Attempt(number, f"{command}, files of {limit} bytes at most", lost)


def _on_small_disk(folder: Path, seed: int, numbers: Sequence[int]) -> Iterator[Attempt | Skipped]:
    commands = _Commands(folder)
    with small_disk(folder / "probe", 4096) as probe:
        if probe is None:
            yield Skipped("mounting a small disk is not permitted here")
            return
    commands.warm_up(folder / "warm", {DISK_CASES[number][0] for number in numbers})
    for number in numbers:
        command, of, free = DISK_CASES[number]
        with small_disk(folder / f"disk-{number}", DISK_BYTES) as disk:
            assert disk is not None
            lost = _fill_and_run(commands, command, of, free, disk, folder / f"other-{number}")
        yield Attempt(number, f"{command}, disk of the {of}, {free} bytes free", lost)


def _fill_and_run(
    commands: _Commands, command: str, of: str, free: int, disk: Path, other: Path
) -> str | None:
    results_there = of.startswith("results")
    out, tmp = (disk / "out", other) if results_there else (other, disk / "tmp")
    for folder in (out, tmp):
        folder.mkdir(parents=True)
    if "while it runs" not in of:
        fill_disk(disk, free)
        return _fault(scenenet(*commands.call(command, out), tmp=tmp), out)
    process = start(*commands.call(command, out), tmp=tmp)
    watched, begins = (out, ".line.laz.") if results_there else (tmp, "scenenet-")
    if wait_for(lambda: has(watched, begins), process):
        fill_disk(disk)
    return _fault(end_of(process), out)


SUBJECTS = [
    Subject("disk full: limit on file sizes", _with_limit, len(LIMIT_CASES)),
    Subject("disk full: small disk", _on_small_disk, len(DISK_CASES)),
]
