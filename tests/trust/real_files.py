"""Every command on a real file ends in an answer or in an error that names the file, and soon.

``look_at`` runs the command line as a user does, each command in a process of its own. Run as a
script, it prints a table::

    python tests/trust/real_files.py FILE... --model MODEL.json
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import laspy
import numpy as np
from fixtures.forked import SCENENET

from scenenet.pointcloud.append_dimensions import REWRITTEN
from scenenet.pointcloud.las.header import read_header

ADDED = ("tower_probability", "tower_id")
HUNG_S = 120.0
"""A command that takes longer has hung."""
LARGE = 1_000_000
"""Points from which on no time is promised."""
LIMIT_S = 10.0
"""Time for a file of less than ``LARGE`` points on an idle machine, s."""


@dataclass(frozen=True)
class Outcome:
    """How a command on a file ended.

    Attributes:
        file: the file.
        command: ``check`` or ``predict``.
        answered: whether there is an answer; else there is an error.
        seconds: until the end, start of Python included.
        cpu_seconds: of the processor: what an idle machine would take at most.
        message: the error, or the warnings.
        faults: what must not happen: a crash, an error without the name of the file, a lost
            dimension. Empty if all is well.
        n_points: number of points of the answer.
    """

    file: Path
    command: str
    answered: bool
    seconds: float
    cpu_seconds: float
    message: str
    faults: tuple[str, ...]
    n_points: int = 0


def real_files() -> list[Path]:
    """The awkward files and the field recordings; none where there are no real recordings."""
    root = Path(__file__).resolve().parents[3] / "shared" / "data"
    data = Path(os.environ.get("SCENENET_REAL_DATA", root))
    return sorted(path for folder in ("zoo", "field") for path in (data / folder).glob("*.la[sz]"))


def look_at(files: Iterable[Path], model: Path) -> Iterator[Outcome]:
    """Run ``check`` and ``predict`` on each file, and compare the prediction with the file.

    Args:
        files: surveys or TS40K samples.
        model: model file with tau.
    """
    for file in files:
        with tempfile.TemporaryDirectory(prefix="look-") as folder:
            yield _run(file, "check", [file, "--codes", "asprs", "--json"])
            out = Path(folder)
            yield _run(file, "predict", [file, "--model", model, "--out", out, "--json"], out)


def _run(file: Path, command: str, arguments: list[object], out: Path | None = None) -> Outcome:
    call = [sys.executable, "-c", SCENENET, command]
    start, used = time.perf_counter(), _cpu_seconds()
    try:
        done = subprocess.run(
            [*call, *map(str, arguments)], capture_output=True, text=True, timeout=HUNG_S
        )
    except subprocess.TimeoutExpired:
        return Outcome(file, command, False, HUNG_S, HUNG_S, "", (f"hung for {HUNG_S:g} s",))
    seconds, used = time.perf_counter() - start, _cpu_seconds() - used
    named = [x for x in done.stderr.splitlines() if x.startswith(("error:", "warning:"))]
    message = "\n".join(named)
    faults = []
    if done.returncode not in (0, 1) or "Traceback" in done.stderr:
        faults.append(f"ended with code {done.returncode}: {done.stderr[-2000:]}")
    if done.returncode == 1 and not any(x.startswith("error:") and file.name in x for x in named):
        faults.append("no error names the file")
    left = [] if out is None else sorted(path.name for path in out.iterdir())
    if done.returncode == 1 and left:
        faults.append(f"an error, but {', '.join(left)} was written")
    n_points = 0
    if done.returncode == 0:
        n_points = json.loads(done.stdout)[0]["n_points" if command == "check" else "points"]
        if out is not None:
            faults += differences(file, next(out.glob("*.laz")))
    answered = done.returncode == 0
    return Outcome(file, command, answered, seconds, used, message, tuple(faults), n_points)


def _cpu_seconds() -> float:
    """Processor time of all child processes that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def differences(source: Path, target: Path) -> list[str]:
    """What of a survey is not in its prediction: points, their order, dimensions, scale, CRS."""
    new = laspy.read(target)
    if source.suffix not in (".las", ".laz"):
        return [] if source.suffix != ".npy" else _differences_of_sample(np.load(source), new)
    old = laspy.read(source)
    lost = [name for name in ADDED if name not in new.point_format.dimension_names]
    if len(old.points) != len(new.points):
        return [*lost, f"{len(old.points)} points became {len(new.points)}"]
    before, after = old.points.array, new.points.array
    for name in before.dtype.names:
        if name in ADDED or name.startswith("share_"):
            continue
        same = _bytes_of(after, name, before.dtype[name].itemsize)
        if same is None or before[name].tobytes() != same:
            lost.append(f"dimension {name}")
    for field in ("scales", "offsets"):
        if not np.array_equal(getattr(old.header, field), getattr(new.header, field)):
            lost.append(f"{field} of the header")
    kept = {(r.user_id, r.record_id, r.data) for r in read_header(target).records}
    for record in read_header(source).records:  # laspy takes the points for a record if one lacks
        if (record.user_id, record.record_id) in REWRITTEN or record.user_id == "copc":
            continue
        if (record.user_id, record.record_id, record.data) not in kept:
            lost.append(f"record {record.user_id} {record.record_id}")
    return lost


def _bytes_of(array: np.ndarray, name: str, size: int) -> bytes | None:
    """The bytes of a dimension; long ones without a description come back in numbered parts."""
    if name in array.dtype.names:
        return array[name].tobytes()
    parts = [n for n in array.dtype.names if n.removeprefix(name).isdigit()]
    if sum(array.dtype[part].itemsize for part in parts) != size:
        return None
    columns = [array[part].view(np.uint8).reshape(len(array), -1) for part in parts]
    return np.concatenate(columns, axis=1).tobytes()


def _differences_of_sample(sample: np.ndarray, new: laspy.LasData) -> list[str]:
    xyz = np.column_stack([new.x, new.y, new.z])
    if len(xyz) != len(sample) or np.abs(xyz - sample[:, :3]).max(initial=0) > 0.00051:
        return ["coordinates"]
    same = np.array_equal(np.asarray(new.classification), sample[:, 3].astype(int))
    return [] if same else ["class codes"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--model", required=True, type=Path)
    given = parser.parse_args()
    lost = 0
    for outcome in look_at(given.files, given.model):
        how = "answer" if outcome.answered else "error"
        print(
            f"{outcome.file.name:<60} {outcome.command:<8} {how:<7} {outcome.seconds:6.1f} s "
            f"({outcome.cpu_seconds:.1f} s)"
        )
        for text in (*outcome.faults, *outcome.message.splitlines()):
            print(f"    {text}"[:300])
        lost += bool(outcome.faults)
    print(f"{lost} faults")
    return int(lost > 0)


if __name__ == "__main__":
    sys.exit(main())
