"""Two runs at once in one folder."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from trust.kills import tiny_project
from trust.originals import write_pole_model, write_survey
from trust.processes import end_of, files_in, has, must, predict, start, wait_for
from trust.table import Attempt, Subject


def _same_survey(folder: Path) -> str | None:
    """Both write the same result, or one of them says why it does not."""
    survey, model = _inputs(folder)
    must(*predict(survey, model, folder / "reference"))
    out, tmp = folder / "out", folder / "tmp"
    processes = [start(*predict(survey, model, out), tmp=tmp) for _ in range(2)]
    ended = [end_of(process) for process in processes]
    faults = [done.fault for done in ended if done.fault is not None]
    if faults:
        return faults[0]
    if all(done.code for done in ended):
        return f"both failed: {ended[0].err}"
    return _not_as(folder / "reference", out) or _left(out, tmp)


def _two_surveys(folder: Path) -> str | None:
    """Each gives the result that it gives alone."""
    survey, model = _inputs(folder)
    other = folder / "other.laz"
    shutil.copy(survey, other)
    out, tmp = folder / "out", folder / "tmp"
    processes = [start(*predict(path, model, out), tmp=tmp) for path in (survey, other)]
    for process in processes:
        done = end_of(process)
        if done.code != 0:
            return f"one of them failed: {done.err}"
    return _wrong_records(out) or _left(out, tmp)


def _two_models(folder: Path) -> str | None:
    """The files of one name belong to one run, whichever ends last."""
    survey, model = _inputs(folder)
    other = folder / "other.json"
    card = json.loads(model.read_text())
    other.write_text(json.dumps(card | {"name": "other", "tau": 0.9}))
    out, tmp = folder / "out", folder / "tmp"
    processes = [start(*predict(survey, path, out), tmp=tmp) for path in (model, other)]
    ended = [end_of(process) for process in processes]
    faults = [done.fault for done in ended if done.fault is not None]
    if faults:
        return faults[0]
    return _wrong_records(out) or _left(out, tmp)


def _two_workflows(folder: Path) -> str | None:
    """The second says that the folder is locked, and the first is not disturbed."""
    project = tiny_project(folder / "project")
    target = "results/synthetic/line.laz"
    first = subprocess.Popen(
        project.command("--cores", "1", target),
        cwd=project.folder,
        env=project.environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    if not wait_for(lambda: has(project.folder / ".snakemake/locks", "0."), first):
        raise RuntimeError(f"the workflow took no lock: {first.communicate()[0]}")
    os.killpg(first.pid, signal.SIGSTOP)  # or it could end before the second one looks
    second = project.snakemake("--cores", "1", target)
    os.killpg(first.pid, signal.SIGCONT)
    shown, _ = first.communicate()
    if second.returncode == 0 or "lock" not in second.stdout:
        return f"the second run ended with {second.returncode}: {second.stdout[-400:]}"
    if first.returncode != 0:
        return f"the first run failed: {shown[-400:]}"
    return None if (project.folder / target).exists() else "the first run made no result"


def _inputs(folder: Path) -> tuple[Path, Path]:
    survey, model = folder / "line.laz", folder / "model.json"
    write_survey(survey, poles=8)
    write_pole_model(model)
    return survey, model


def _not_as(reference: Path, out: Path) -> str | None:
    one, other = files_in(reference), files_in(out)
    names = [name for name in one if not name.endswith(".summary.json")]
    wrong = [name for name in names if one[name] != other.get(name)]
    return f"not as in a single run: {wrong}" if wrong else _wrong_records(out)


def _wrong_records(out: Path) -> str | None:
    """A result that is not the one that its summary records."""
    from scenenet.core.provenance import fingerprint

    for summary in out.glob("*.summary.json"):
        for name, recorded in json.loads(summary.read_text())["outputs"].items():
            if fingerprint(out / name) != recorded:
                return f"{name} is not the file that {summary.name} records"
    return None if list(out.glob("*.summary.json")) else "there is no result"


def _left(out: Path, tmp: Path) -> str | None:
    left = [path.name for path in out.glob(".*")] + [path.name for path in tmp.iterdir()]
    return f"scratch folders stay: {left}" if left else None


CASES: dict[str, Callable[[Path], str | None]] = {
    "two predictions of one survey": _same_survey,
    "two predictions of two surveys": _two_surveys,
    "two predictions of one survey with two models": _two_models,
    "two runs of the workflow": _two_workflows,
}


def _try(folder: Path, seed: int, numbers: Sequence[int]) -> Iterator[Attempt]:
    for number in numbers:
        what, case = list(CASES.items())[number]
        own = folder / str(number)
        own.mkdir()
        yield Attempt(number, what, case(own))


SUBJECTS = [Subject("two runs at once in one folder", _try, len(CASES))]
