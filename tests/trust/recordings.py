"""Real recordings, which are not part of the project: ``check`` and ``predict`` on each of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from trust.originals import write_pole_model
from trust.real_files import LARGE, LIMIT_S, look_at, real_files
from trust.table import Attempt, Skipped, Subject


def _try(folder: Path, seed: int, numbers: Sequence[int]) -> Iterator[Attempt | Skipped]:
    files = real_files()
    if not files:
        yield Skipped("no real recordings here: set SCENENET_REAL_DATA to a folder that has them")
        return
    model = folder / "model.json"
    write_pole_model(model)
    for number in numbers:
        lost = []
        for outcome in look_at([files[number]], model):
            lost += outcome.faults
            seconds = min(outcome.seconds, outcome.cpu_seconds)
            if outcome.n_points < LARGE and seconds > LIMIT_S:
                lost.append(f"{outcome.command} took {seconds:.1f} s")
        yield Attempt(number, f"real file {files[number].name}", "; ".join(lost) or None)


SUBJECTS = [Subject("real files", _try, max(1, len(real_files())))]
