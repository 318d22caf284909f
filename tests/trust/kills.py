"""``kill -9`` of a prediction and of the workflow: the next start makes the same result.

Nothing half-made stays: no file under a final name, no scratch folder, no second run in MLflow.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import os
import re
import shutil
import signal
import sqlite3
import subprocess
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from fixtures.project import PARTS, Project, copy_parts
from trust.originals import write_pole_model, write_survey
from trust.processes import (
    LIMIT_S,
    end_of,
    files_in,
    has,
    predict,
    scenenet,
    start,
    wait_for,
)
from trust.table import Attempt, Subject

PREDICT_KILLS, WORKFLOW_KILLS = 10, 20
ROOT = Path(__file__).resolve().parents[2]
TINY = Path(__file__).with_name("tiny.yaml")
SCRATCH = re.compile(r"\..+\.[a-z0-9_]{8}|scenenet-[a-z0-9_]{8}")
"""Names of scratch folders, beside a result and in the temporary directory."""
TIMES = re.compile(r"second|minute|_ms|_s$|time|speed|date$|memory|started|ended")
"""Keys and columns that differ between two equal runs."""


# predict


def _kill_predict(folder: Path, seed: int, numbers: Sequence[int]) -> Iterator[Attempt]:
    survey, model = folder / "line.laz", folder / "model.json"
    write_survey(survey, poles=4)
    write_pole_model(model)
    reference = folder / "reference"
    seconds = _start_and_kill(predict(survey, model, reference), folder / "tmp", None)
    wanted = _results(reference)
    if not wanted:
        raise RuntimeError("the prediction fails without a disturbance")
    for number in numbers:
        share = (number % PREDICT_KILLS + _random(seed, number)) / PREDICT_KILLS
        out, tmp = folder / f"out-{number}", folder / f"tmp-{number}"
        ran = _start_and_kill(predict(survey, model, out), tmp, share * seconds)
        if ran < share * seconds:  # the first one had to compile, or the machine is less busy now
            seconds = ran
            shutil.rmtree(out)
            _start_and_kill(predict(survey, model, out), tmp, share * seconds)
        lost = _half_made(out, wanted)
        done = scenenet(*predict(survey, model, out), tmp=tmp)
        if lost is None and done.code != 0:
            lost = f"the next start failed: {done.err[-400:]}"
        if lost is None and _results(out) != wanted:
            lost = "the next start gave another result"
        if lost is None and set(files_in(out)) != set(files_in(reference)):
            lost = f"there are other files: {sorted(files_in(out))}"
        if lost is None and any(tmp.iterdir()):
            lost = f"temporary files stay: {[path.name for path in tmp.iterdir()]}"
        yield Attempt(number, f"predict killed after {share:.0%} of its work", lost)


def _start_and_kill(arguments: Sequence[object], tmp: Path, seconds: float | None) -> float:
    """Kill a prediction some seconds after it made its scratch folder; returns how long it ran."""
    process = start(*arguments, tmp=tmp)
    if not wait_for(lambda: has(tmp, "scenenet-"), process):
        raise RuntimeError(f"the prediction made no scratch folder: {end_of(process)}")
    began = time.monotonic()
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(LIMIT_S if seconds is None else seconds)
    ran = time.monotonic() - began
    process.kill()
    process.communicate()
    return ran


def _random(seed: int, number: int) -> float:
    return float(np.random.default_rng([seed, number]).random())


def _half_made(out: Path, wanted: dict[str, Any]) -> str | None:
    """A file under a final name that is not the whole result."""
    for name, content in _results(out).items():
        if not SCRATCH.search(name) and content != wanted.get(name):
            return f"{name} is half made"
    return None


def _results(folder: Path) -> dict[str, Any]:
    """The files of a prediction, without the seconds that it took."""
    return {name: _plain(name, data) for name, data in files_in(folder).items()}


def _plain(name: str, data: bytes) -> Any:
    """A result that two equal runs share: without times."""
    try:
        if name.endswith((".json", ".geojson")):
            return _without_times(json.loads(data))
        if name.endswith(".csv"):
            rows = csv.DictReader(io.StringIO(data.decode()))
            return [_without_times(row) for row in rows]
    except ValueError:
        return data
    return data


def _without_times(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _without_times(v) for k, v in value.items() if not TIMES.search(str(k))}
    return [_without_times(v) for v in value] if isinstance(value, list) else value


# The workflow


def tiny_project(folder: Path) -> Project:
    """The project with a configuration of one line, one model and two seeds."""
    copy_parts(ROOT, folder, PARTS)
    project = Project(folder, package=ROOT, tmp=folder.with_name(f"{folder.name}-tmp"))
    project.tmp.mkdir()
    (folder / "config" / "config.yaml").write_text(TINY.read_text(encoding="utf-8"))
    (folder / "config" / "surveys.tsv").write_text("survey\tpath\tcodes\trole\n")
    for name, role in (("line", "train"), ("own", "new")):
        project.add_row(name, "{results_dir}/synthetic/line.laz", "edp", role)
    return project


def _kill_workflow(folder: Path, seed: int, numbers: Sequence[int]) -> Iterator[Attempt]:
    whole, killed = tiny_project(folder / "whole"), tiny_project(folder / "killed")
    whole.run("--cores", "2")
    jobs = _finished_jobs(whole)
    for number in numbers:
        done_before = _finished_jobs(killed)
        enough = (number + 1) * jobs // (len(numbers) + 1)
        how = _run_and_kill(killed, enough, _random(seed, number), number, folder / "shown.txt")
        lost = _cannot_resume(killed)
        what = f"workflow {how} with {_finished_jobs(killed)} of {jobs} jobs done"
        if lost is None and _finished_jobs(killed) < done_before:
            what += f" ({done_before} before)"
        yield Attempt(number, what, lost)
    last = killed.snakemake("--cores", "2")
    lost = None if last.returncode == 0 else f"it does not end: {last.stdout[-1500:]}"
    for place, (what, compare) in enumerate(_COMPARED.items()):
        if lost is None or place == 0:
            found = lost or compare(whole, killed)
            yield Attempt(
                len(numbers) + place, f"workflow after {len(numbers)} kills: {what}", found
            )


def _run_and_kill(project: Project, enough: int, more: float, number: int, shown: Path) -> str:
    """Start the workflow and kill it a random moment after ``enough`` jobs are done in all.

    Every third time only Snakemake is killed, and its jobs go on for a while without it; else all
    of its processes are, as in a power cut.
    """
    with shown.open("w") as stream:
        process = subprocess.Popen(
            project.command("--cores", "2"),
            cwd=project.folder,
            env=project.environment(),
            stdout=stream,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        reached = wait_for(lambda: _finished_jobs(project) >= enough, process)
        if reached:
            time.sleep(3 * more)
        if process.poll() is not None:
            return f"ended by itself ({process.returncode})"
        if number % 3 == 2:
            process.kill()
            how = "killed without its jobs"
        else:
            os.killpg(process.pid, signal.SIGKILL)
            how = "killed"
        process.wait()
    return how


def _cannot_resume(project: Project) -> str | None:
    """What docs/development/reruns.md says to do after a kill."""
    done = project.snakemake("--unlock")
    return None if done.returncode == 0 else f"it cannot be unlocked: {done.stdout[-400:]}"


def _finished_jobs(project: Project) -> int:
    """Snakemake writes a benchmark at the end of a job."""
    folder = project.results / "benchmarks"
    return sum(len(files) for _, _, files in os.walk(folder))


def _same(patterns: Sequence[str], whole: Project, killed: Project) -> str | None:
    found: list[dict[str, Any]] = [{}, {}]
    for project, contents in zip((whole, killed), found, strict=True):
        for pattern in patterns:
            for path in sorted(project.results.glob(pattern)):
                if path.is_file():
                    name = str(path.relative_to(project.results))
                    contents[name] = _plain(name, path.read_bytes())
    if not found[0]:
        raise RuntimeError(f"the uninterrupted run has none of {patterns}")
    names = sorted(found[0].keys() | found[1].keys())
    other = [name for name in names if found[0].get(name) != found[1].get(name)]
    return f"not as in an uninterrupted run: {', '.join(other)}" if other else None


def _same_models(whole: Project, killed: Project) -> str | None:
    return _same(("models/**/*.json", "train/*/*/model.json"), whole, killed)


def _same_scores(whole: Project, killed: Project) -> str | None:
    names = ("models", "seeds", "parameters", "tower_scores", "towers", "whole_towers", "classes")
    patterns = ("tune/**/seed-?.json", "evaluate/**/seed-?.json", "boosted_trees/**/seed-?.json",
                "split/*.csv", "towers/*/*.csv", "certificate/*.json")  # fmt: skip
    return _same((*patterns, *(f"tables/{name}.csv" for name in names)), whole, killed)


def _same_predictions(whole: Project, killed: Project) -> str | None:
    return _same(("predict/*/*.laz", "predict/*/*.geojson"), whole, killed)


def _same_runs(whole: Project, killed: Project) -> str | None:
    """Name of a run in MLflow -> how often it is there."""
    one, other = (_runs(project) for project in (whole, killed))
    if not one:
        raise RuntimeError("the uninterrupted run has no run in MLflow")
    return None if one == other else f"{one} in an uninterrupted run, {other} in this one"


def _runs(project: Project) -> dict[str, int]:
    with sqlite3.connect(project.folder / "mlflow.db") as store:
        rows = store.execute(
            "SELECT e.name || ' ' || r.name FROM runs r JOIN experiments e USING (experiment_id) "
            "WHERE r.lifecycle_stage = 'active' AND r.status = 'FINISHED'"
        ).fetchall()
    return dict(sorted(Counter(name for (name,) in rows).items()))


def _no_scratch(whole: Project, killed: Project) -> str | None:
    places = [*killed.folder.rglob("*"), *killed.tmp.iterdir()]
    left = [str(path) for path in places if SCRATCH.fullmatch(path.name)]
    return f"scratch folders stay: {left}" if left else None


def _complete(whole: Project, killed: Project) -> str | None:
    planned = killed.planned()
    return f"a run has still to do {planned}" if planned else None


_COMPARED = {
    "the same models": _same_models,
    "the same scores": _same_scores,
    "the same predictions": _same_predictions,
    "every run once in MLflow": _same_runs,
    "no scratch folder": _no_scratch,
    "nothing is left to do": _complete,
}

SUBJECTS = [
    Subject("kill -9 of predict", _kill_predict, PREDICT_KILLS),
    Subject("kill -9 of the workflow", _kill_workflow, WORKFLOW_KILLS, one_by_one=False),
]
