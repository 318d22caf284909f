"""A survey that another program replaces while ``scenenet predict`` reads it.

The command may notice it and end with a message, and then the earlier result stays; or its result
is that of one of the two files as a whole.
"""

from __future__ import annotations

import shutil
import signal
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from fixtures.scenes import make_scene
from trust.originals import write_pole_model
from trust.processes import end_of, files_in, has, must, predict, start, wait_for
from trust.table import Attempt, Subject

from scenenet.pointcloud import PointCloud, write_las

SHIFTS_M = {"shifted by 5 m": 5.0, "shifted by 5 km": 5000.0}
OTHERS = (*SHIFTS_M, "with fewer points")
MOMENTS = ("before its points are written", "while its voxels are read")
CASES = [
    (moment, other, in_place)
    for in_place in (False, True)
    for moment in MOMENTS
    for other in OTHERS
]
NAME = "line"


def _try(folder: Path, seed: int, numbers: Sequence[int]) -> Iterator[Attempt]:
    surveys = _surveys(folder / "surveys")
    model = folder / "model.json"
    write_pole_model(model)
    for number in numbers:
        moment, other, in_place = CASES[number]
        how = "written over" if in_place else "replaced"
        what = f"survey {how} {moment} by one {other}"
        yield Attempt(number, what, _replace(folder / str(number), surveys, model, CASES[number]))


def _surveys(folder: Path) -> dict[str, Path]:
    folder.mkdir()
    cloud = make_scene([(15.5 + 30 * i, 15.5) for i in range(4)], size=(120.0, 30.0))
    half = slice(len(cloud) // 2)
    fewer = PointCloud(cloud.xyz[half], cloud.classification[half], cloud.scheme)
    clouds = {"original": cloud, "with fewer points": fewer}
    for name, shift in SHIFTS_M.items():
        moved = cloud.xyz + np.array([shift, 0.0, 0.0])
        clouds[name] = PointCloud(moved, cloud.classification, cloud.scheme)
    paths = {}
    for number, (name, points) in enumerate(clouds.items()):
        paths[name] = folder / str(number) / f"{NAME}.laz"
        write_las(paths[name], points)
    return paths


def _replace(
    folder: Path, surveys: dict[str, Path], model: Path, case: tuple[str, str, bool]
) -> str | None:
    moment, other, in_place = case
    folder.mkdir()
    survey, out, tmp = folder / f"{NAME}.laz", folder / "out", folder / "tmp"
    shutil.copy(surveys["original"], survey)
    must(*predict(survey, model, out), tmp=tmp)
    before = files_in(out)
    watched, begins = (out, f".{NAME}.laz.") if moment == MOMENTS[0] else (tmp, "scenenet-")
    process = start(*predict(survey, model, out), tmp=tmp)
    if not wait_for(lambda: has(watched, begins), process):
        return f"the moment never came: {end_of(process)}"
    process.send_signal(signal.SIGSTOP)
    if in_place:
        survey.write_bytes(surveys[other].read_bytes())
    else:
        incoming = folder / "incoming"
        shutil.copy(surveys[other], incoming)
        incoming.replace(survey)
    process.send_signal(signal.SIGCONT)
    done = end_of(process)
    after = files_in(out)
    if done.fault is not None:
        return done.fault
    if done.code == 1:
        if survey.name not in done.err:
            return f"the message does not name the survey: {done.err}"
        return None if after == before else "the earlier result was changed or removed"
    name = f"{NAME}.laz"
    if after[name] == before[name]:
        return None
    fresh = folder / "fresh"
    must(*predict(survey, model, fresh), tmp=tmp)
    if after[name] == files_in(fresh)[name]:
        return None
    return "exit code 0 with a result of neither the one survey nor the other"


SUBJECTS = [Subject("survey replaced while it is read", _try, len(CASES))]
