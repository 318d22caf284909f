"""A prediction of many files that was stopped goes on where it stopped."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import laspy
import numpy as np
import pyproj
import pytest

from scenenet.core.errors import InputError, OutputError
from scenenet.detection.settings import DetectionSettings
from scenenet.pointcloud import PointCloud, write_las
from scenenet.prediction import predict, tile_results
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.writers import predict_to_files

LONE_POLES = DetectionSettings(min_conductor=0)
STEPS = {"read_file": predict, "predict_file": predict, "find_in_survey": predict,
         "write_file": tile_results}  # fmt: skip
"""The stages, and where they are called from."""


@pytest.fixture(scope="module")
def original(scene, tmp_path_factory) -> Path:
    """A folder of three tiles with two poles."""
    cloud = scene([(15.5, 15.5), (60.5, 15.5)], size=(76.0, 31.0), tree=None)
    folder = tmp_path_factory.mktemp("original") / "line"
    folder.mkdir()
    part = np.searchsorted([525.0, 550.0], cloud.xyz[:, 0] - 499_500)
    for number in range(3):
        own = part == number
        tile = PointCloud(cloud.xyz[own], cloud.classification[own], crs=pyproj.CRS(32629))
        write_las(folder / f"{number}.laz", tile)
    return folder


@pytest.fixture
def tiles(original, tmp_path) -> Path:
    folder = tmp_path / "line"
    folder.mkdir()
    for path in original.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    return folder


@pytest.fixture
def steps(monkeypatch):
    """Counts the calls of each stage; ``stop`` names the call at which a run is stopped."""

    class Steps:
        def __init__(self) -> None:
            self.done: Counter[str] = Counter()
            self.stop: tuple[str, int, BaseException] | None = None

        def watch(self, name: str, module) -> None:
            step = getattr(module, name)

            def watched(*args, **named):
                if self.stop and self.stop[:2] == (name, self.done[name]):
                    raise self.stop[2]
                self.done[name] += 1
                return step(*args, **named)

            monkeypatch.setattr(module, name, watched)

    steps = Steps()
    for name, module in STEPS.items():
        steps.watch(name, module)
    return steps


def run(tiles: Path, model: Path, out: Path, **settings) -> PredictionFiles:
    survey = SurveyFiles.of(tiles)
    files = PredictionFiles.of(survey, out)
    predict_to_files(survey, model, files, PredictSettings(**settings), LONE_POLES)
    return files


def contents(files: PredictionFiles) -> dict[str, bytes]:
    """The results, but for the summary, which has the time."""
    return {path.name: path.read_bytes() for path in [*files.points.values(), *files.lists]}


@pytest.fixture(scope="module")
def expected(original, model, tmp_path_factory) -> dict[str, bytes]:
    return contents(run(original, model, tmp_path_factory.mktemp("expected")))


FULL = OutputError("the disk is full")


@pytest.mark.parametrize(
    ("stop", "again"),
    [
        (("read_file", 1), (2, 3, 1, 3)),
        (("predict_file", 2), (0, 1, 1, 3)),
        (("find_in_survey", 0), (0, 0, 1, 3)),
        (("write_file", 2), (0, 0, 0, 1)),
    ],
)
@pytest.mark.parametrize("error", [KeyboardInterrupt(), FULL], ids=["ctrl-c", "full disk"])
def test_a_run_goes_on_where_it_was_stopped(
    tiles, model, tmp_path, steps, expected, stop, again, error, capsys
):
    steps.stop = (*stop, error)
    with pytest.raises(type(error)):
        run(tiles, model, tmp_path / "out")
    work = tmp_path / "out" / ".line.work"
    assert f"what was done is kept in {work}" in capsys.readouterr().err
    steps.stop, steps.done = None, Counter()
    files = run(tiles, model, tmp_path / "out")
    assert tuple(steps.done[name] for name in STEPS) == again
    assert contents(files) == expected
    assert not work.exists()


def test_a_killed_run_goes_on(tiles, model, tmp_path, steps, expected):
    script = (
        "import time; from pathlib import Path; from scenenet.prediction import predict\n"
        "find = predict.find_in_survey\n"
        "predict.find_in_survey = lambda *a: (print('now', flush=True), time.sleep(60), find(*a))\n"
        "from prediction.test_resume import run\n"
        f"run(*map(Path, {[str(tiles), str(model), str(tmp_path / 'out')]!r}))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    assert process.stdout.readline() == "now\n"
    process.send_signal(signal.SIGKILL)
    process.communicate()
    files = run(tiles, model, tmp_path / "out")
    assert (steps.done["read_file"], steps.done["predict_file"]) == (0, 0)
    assert contents(files) == expected


def stopped(tiles, model, out, steps) -> None:
    steps.stop = ("write_file", 1, KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        run(tiles, model, out)
    steps.stop, steps.done = None, Counter()


def test_other_settings_discard_what_was_done(tiles, model, tmp_path, steps, capsys):
    stopped(tiles, model, tmp_path / "out", steps)
    run(tiles, model, tmp_path / "out", classify=True)
    assert steps.done["read_file"] == 3
    assert "the settings or the program have changed" in capsys.readouterr().err


def test_another_file_is_read_and_all_is_predicted_again(tiles, model, tmp_path, steps, capsys):
    stopped(tiles, model, tmp_path / "out", steps)
    points = laspy.read(tiles / "1.laz")
    points.points = points.points[:-5]
    time.sleep(0.01)
    points.write(tiles / "1.laz")
    run(tiles, model, tmp_path / "out")
    assert tuple(steps.done[name] for name in STEPS) == (1, 3, 1, 3)
    assert "2 of 3 are not read again" in capsys.readouterr().err


def test_results_that_were_removed_since_are_written_again(tiles, model, tmp_path, steps):
    stopped(tiles, model, tmp_path / "out", steps)
    (tmp_path / "out" / "line" / "0.laz").unlink()
    run(tiles, model, tmp_path / "out")
    assert steps.done["write_file"] == 3


def test_a_work_file_that_is_cut_off_is_read_again(tiles, model, tmp_path, steps, expected):
    stopped(tiles, model, tmp_path / "out", steps)
    damaged = sorted((tmp_path / "out" / ".line.work").glob("*.work"))[0]
    damaged.write_bytes(damaged.read_bytes()[:-3])
    files = run(tiles, model, tmp_path / "out")
    assert steps.done["read_file"] == 1
    assert contents(files) == expected


def test_a_survey_without_a_good_file_leaves_no_work_folder(tiles, model, tmp_path):
    for path in tiles.iterdir():
        path.write_bytes(path.read_bytes()[:600])
    with pytest.raises(InputError, match="none of its 3 files"):
        run(tiles, model, tmp_path / "out")
    assert not (tmp_path / "out" / ".line.work").exists()


def test_two_runs_to_one_place_are_refused(tiles, model, tmp_path, monkeypatch):
    def also(*_):
        with pytest.raises(OutputError, match="another process is predicting this survey"):
            run(tiles, model, tmp_path / "out")
        raise KeyboardInterrupt

    monkeypatch.setattr(predict, "find_in_survey", also)
    with pytest.raises(KeyboardInterrupt):
        run(tiles, model, tmp_path / "out")


def test_a_folder_of_the_user_is_never_taken_for_a_work_folder(tiles, model, tmp_path):
    own = tmp_path / "out" / ".line.work"
    own.mkdir(parents=True)
    (own / "notes.txt").write_text("mine")
    with pytest.raises(OutputError, match="is not the work folder of a prediction"):
        run(tiles, model, tmp_path / "out")
    assert (own / "notes.txt").read_text() == "mine"
