"""The command line, called as a user calls it."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import laspy
import numpy as np
import pytest
import typer
from fixtures.forked import SCENENET, command_line

from scenenet.cli.app import COMMANDS, app
from scenenet.cli.options import Codes
from scenenet.pointcloud import SCHEMES
from scenenet.synthetic import SyntheticSettings, make_survey

LIMIT_S = 1800


def scenenet(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """A call in a process of its own."""
    folder = Path.cwd() if cwd is None else cwd
    return command_line().call(SCENENET, [*map(str, arguments)], folder, os.environ, LIMIT_S)


@pytest.fixture(scope="module")
def survey(tmp_path_factory) -> Path:
    """A small synthetic corridor with few points."""
    out = tmp_path_factory.mktemp("survey") / "corridor.laz"
    make_survey(SyntheticSettings(towers=3, seed=5, density=20), out)
    return out


@pytest.fixture(scope="module")
def model(survey, tmp_path_factory) -> Path:
    """A model trained on it for a moment, and the output of the command."""
    out = tmp_path_factory.mktemp("model") / "model.json"
    made = scenenet("train", survey, "--codes", "edp", "--out", out, "--resolution", 32,
                    "--seeds", 2, "--json")  # fmt: skip
    assert made.returncode == 0, made.stderr
    output = json.loads(made.stdout)
    assert output["crops"] == {"training": 3, "validation": 0}
    assert output["tuned_on"] == "training"
    assert len(output["seeds"]) == 2
    assert "generations" in made.stderr
    assert json.loads(out.read_text())["units"] == "m"
    made_by = json.loads(out.read_text())["provenance"]
    assert {"seed", "data", "config", "version", "files"} <= made_by.keys()
    return out


def test_the_thesis_protocol_can_be_selected(survey, tmp_path):
    out = tmp_path / "thesis.json"
    made = scenenet("train", survey, "--codes", "edp", "--out", out, "--resolution", 32,
                    "--protocol", "thesis", "--epochs", 2, "--seeds", 1, "--json")  # fmt: skip
    assert made.returncode == 0, made.stderr
    assert json.loads(made.stdout)["crops"] == {"training": 2, "validation": 1}
    assert json.loads(out.read_text())["units"] == "voxel"


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_every_command_has_an_example(command):
    shown = scenenet(command, "--help")
    assert shown.returncode == 0
    assert "Options:" in shown.stdout and "--json" in shown.stdout
    assert re.search(rf"Examples?:\n+  scenenet {command} ", shown.stdout)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_example_is_a_valid_call(command):
    """The options exist: a call may fail because of its files, but not with code 2."""
    group = typer.main.get_command(app)
    for example in COMMANDS[command].EXAMPLES:
        arguments = shlex.split(example.partition(" >")[0])
        assert arguments[:2] == ["scenenet", command]
        group.commands[command].make_context(command, arguments[2:])


def test_a_learning_rate_out_of_bounds_is_named(tmp_path):
    out = tmp_path / "m.json"
    options = ["--protocol", "thesis", "--epochs", 1, "--learning-rate", 1e300]
    made = scenenet("train", "a.laz", "--codes", "edp", "--out", out, *options)
    assert made.returncode == 2
    assert "Invalid value for '--learning-rate'" in made.stderr
    assert "--protocol thesis" not in made.stderr and "--epochs" not in made.stderr


@pytest.mark.parametrize("option", ["--epochs", "--learning-rate"])
def test_options_of_the_gradient_are_refused_for_a_searched_model(tmp_path, option):
    done = scenenet("train", "a.laz", "--codes", "edp", "--out", tmp_path / "m.json", option, 1)
    assert done.returncode == 2
    assert option in done.stderr and "search" in done.stderr


def test_a_synthetic_survey_has_as_many_points_as_its_truth(tmp_path):
    survey, truth = tmp_path / "corridor.laz", tmp_path / "truth.laz"
    made = scenenet("synth", survey, "--towers", 2, "--seed", 5, "--truth", truth)
    assert made.returncode == 0, made.stderr
    reports = json.loads(scenenet("check", survey, truth, "--json").stdout)
    assert reports[0]["n_points"] == reports[1]["n_points"] > 100_000


def test_a_continuous_synthetic_line_goes_on_beyond_its_towers(tmp_path):
    lengths = []
    for name, options in (("gaps.laz", ()), ("whole.laz", ("--continuous",))):
        made = scenenet("synth", tmp_path / name, "--towers", 2, *options)
        assert made.returncode == 0, made.stderr
        with laspy.open(tmp_path / name) as file:
            lengths.append(np.hypot(*(file.header.maxs - file.header.mins)[:2]))
    assert lengths[1] > lengths[0] + 50
    again = scenenet("synth", tmp_path / "whole.laz", "--towers", 1)
    assert "whole.laz replaced" in again.stdout and "1 tower\n" in again.stdout


def test_check_prints_a_table_for_people(survey):
    shown = scenenet("check", survey, "--codes", "edp")
    assert shown.returncode == 0
    assert "Power line support tower" in shown.stdout


def test_predict_writes_the_files_of_a_survey(survey, model, tmp_path):
    done = scenenet("predict", survey, "--model", model, "--out", tmp_path, "--json")
    assert done.returncode == 0, done.stderr
    names = {f.name for f in tmp_path.iterdir()}
    assert names == {
        "corridor.laz", "corridor.gpkg", "corridor.towers.csv", "corridor.towers.geojson",
        "corridor.html", "corridor.summary.json",
    }  # fmt: skip
    summary = json.loads((tmp_path / "corridor.summary.json").read_text())
    assert json.loads(done.stdout) == [summary]


def test_evaluate_prints_the_documented_scores(survey, model):
    done = scenenet("evaluate", survey, "--model", model, "--codes", "edp",
                    "--resolution", 32, "--json")  # fmt: skip
    assert done.returncode == 0, done.stderr
    scores = json.loads(done.stdout)
    assert set(scores["voxel"]) == {
        "precision", "recall", "f05", "iou_tower", "miou", "tau", "n_samples",
    }  # fmt: skip
    assert scores["voxel"]["n_samples"] == len(scores["per_sample"]) == 3
    assert scores["voxel_trivial"]["f05"] == 0
    assert scores["voxel_trivial"]["miou"] == pytest.approx(0.5, abs=0.01)
    assert set(scores["towers"]) == {
        "precision", "recall", "median_error_m", "median_height_error_m", "median_base_error_m",
        "n_true", "n_predicted",
    }  # fmt: skip


def test_evaluate_at_the_models_voxel_size_detects_in_the_whole_survey(survey, model):
    done = scenenet("evaluate", survey, "--model", model, "--codes", "edp", "--fit", "metric",
                    "--json")  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["towers"]["n_true"] == 3


@pytest.mark.parametrize("command", ["predict", "evaluate", "explain"])
def test_towers_without_conductors_can_be_accepted(command, model, tmp_path):
    shown = scenenet(command, "--help")
    assert "--min-conductor" in shown.stdout
    refused = scenenet(command, "nowhere.laz", "--model", model, "--min-conductor", "-1")
    assert refused.returncode == 2
    assert "--min-conductor" in refused.stderr


def test_the_required_conductor_length_is_in_the_summary(pole_survey, model, tmp_path):
    out = tmp_path / "out"
    done = scenenet(
        "predict", pole_survey, "--model", model, "--out", out, "--min-conductor", 0, "--json"
    )
    assert done.returncode == 0, done.stderr
    [summary] = json.loads(done.stdout)
    assert summary["settings"]["detection"]["min_conductor"] == 0


def test_explain_writes_a_page_that_needs_no_other_file(survey, model, tmp_path):
    page = tmp_path / "why.html"
    done = scenenet("explain", survey, "--model", model, "--out", page, "--json")
    assert done.returncode == 0, done.stderr
    text = page.read_text()
    assert "reach of the tower" in text
    assert text.index('id="tower-') < text.index('id="model"') < text.index("<details")
    assert not re.search(r"""(src|href|url)\s*[=(]\s*["']?(https?:)?//""", text)
    assert text.count("data:image/png") == len(json.loads(done.stdout))
    footer = text[text.index("<footer>") : text.index("</footer>")]
    card = json.loads(model.read_text())
    made_by = f"Model {card['name']}: protocol operational, seed {card['provenance']['seed']}, 3 "
    assert made_by in footer
    assert "{" not in footer and "thesis (" not in footer


def test_a_missing_survey_ends_with_code_1_and_its_name(model, tmp_path):
    done = scenenet("predict", tmp_path / "no.laz", "--model", model, "--out", tmp_path / "out")
    assert done.returncode == 1
    assert "no.laz" in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


def test_check_continues_after_a_broken_survey_and_reports_it(survey, tmp_path):
    (tmp_path / "broken.laz").write_bytes(b"nothing")
    done = scenenet("check", tmp_path / "broken.laz", survey)
    assert done.returncode == 1
    assert "broken.laz" in done.stderr and "corridor.laz" in done.stdout


def test_a_file_that_is_not_a_model_is_refused(survey, tmp_path):
    (tmp_path / "m.json").write_text("{}")
    done = scenenet("predict", survey, "--model", tmp_path / "m.json", "--out", tmp_path / "out")
    assert done.returncode == 1
    assert "m.json" in done.stderr and "Traceback" not in done.stderr


def test_a_survey_is_never_overwritten_by_its_result(survey, model):
    before = survey.read_bytes()
    done = scenenet("predict", survey, "--model", model, "--out", survey.parent)
    assert done.returncode == 1
    assert survey.read_bytes() == before


def test_wrong_calls_end_with_code_2(survey, tmp_path):
    assert scenenet("evaluate", survey).returncode == 2  # without codes
    assert scenenet("predict", survey).returncode == 2  # without a folder
    assert (
        scenenet("train", survey, "--codes", "guess", "--out", tmp_path / "m.json").returncode == 2
    )
    odd = scenenet("train", survey, "--codes", "edp", "--out", tmp_path / "m.json",
                   "--resolution", 48)  # fmt: skip
    assert odd.returncode == 2
    cnn = scenenet("train", survey, "--codes", "edp", "--out", tmp_path / "m.json", "--kind", "cnn")
    assert cnn.returncode == 2
    assert ".safetensors" in cnn.stderr


def test_training_on_a_survey_without_towers_is_refused(tmp_path):
    from scenenet.pointcloud import PointCloud, write_las

    xyz = np.random.default_rng(0).uniform(0, 30, (500, 3))
    write_las(tmp_path / "field.laz", PointCloud(xyz, np.full(500, 2, np.uint8)))
    done = scenenet("train", tmp_path / "field.laz", "--codes", "edp", "--out", tmp_path / "m.json")
    assert done.returncode == 1
    assert "field.laz" in done.stderr and "--codes" in done.stderr
    assert not (tmp_path / "m.json").exists()


def test_the_command_line_knows_every_class_scheme():
    assert {codes.value for codes in Codes} == set(SCHEMES)


def full_pipe() -> tuple[int, int]:
    """The ends of a pipe with room for nothing: a process that writes to it waits for a reader."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(writing, b"\n")
    os.set_blocking(writing, True)
    return reading, writing


def wait_for(condition: Callable[[], object], process: subprocess.Popen[str]) -> None:
    """Wait for a condition; fail if the process ends before, or after two minutes."""
    end = time.monotonic() + 120
    while not condition():
        assert process.poll() is None, "the process has ended"
        assert time.monotonic() < end, "nothing has happened"
        time.sleep(0.02)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupted_prediction_leaves_nothing_behind(survey, model, tmp_path, number):
    """The signal comes when the survey has been read into temporary files. The process cannot end
    before, however late the signal is: it waits until its progress is read."""
    out = tmp_path / "out"
    call = [sys.executable, "-c", SCENENET, "predict", survey]
    reading, writing = full_pipe()
    with subprocess.Popen(
        [*map(str, call), "--model", str(model), "--out", str(out)],
        stderr=writing,
        text=True,
        env=os.environ | {"TMPDIR": str(tmp_path)},
        # Under some runners Ctrl-C is ignored, and children inherit that.
        preexec_fn=lambda: [
            signal.signal(signal.SIGINT, signal.default_int_handler),
            signal.signal(signal.SIGHUP, signal.SIG_DFL),
        ],
    ) as process:
        os.close(writing)
        with os.fdopen(reading) as stderr:
            wait_for(lambda: list(tmp_path.glob("scenenet-*/files/.*/*.work")), process)
            process.send_signal(number)
            output = stderr.read()
    assert process.returncode == 128 + number
    assert "no incomplete file was left" in output and "Traceback" not in output
    assert list(tmp_path.iterdir()) in ([], [out])
    assert not out.exists() or list(out.iterdir()) == []


def test_codes_of_another_scheme_are_said_where_they_matter(survey, model, tmp_path):
    """EDP codes taken for ASPRS: towers have the same code, but conductors are insulators."""
    done = scenenet("evaluate", survey, "--model", model, "--codes", "asprs", "--json")
    assert done.returncode == 0, done.stderr
    (text,) = json.loads(done.stdout)["warnings"]
    assert f"{survey}: the class codes look like those of scheme edp, not asprs" in text
    assert f"warning: {text}" in done.stderr
    fitting = scenenet("evaluate", survey, "--model", model, "--codes", "edp", "--json")
    assert json.loads(fitting.stdout)["warnings"] == []


@pytest.mark.parametrize("command", ["train", "evaluate", "predict", "explain"])
def test_degrees_without_a_coordinate_system_are_refused(command, survey, model, tmp_path):
    from scenenet.pointcloud import read

    cloud = read(survey)
    degrees = (cloud.xyz - [545_000, 4_633_000, 0]) / [83_000, 111_000, 1] + [-8.45, 41.85, 0]
    path = tmp_path / "degrees.npy"
    np.save(path, np.column_stack([degrees, cloud.classification]))
    out = tmp_path / ("out.html" if command == "explain" else "out.json")
    options = {
        "train": ["--codes", "edp", "--out", out],
        "evaluate": ["--codes", "edp", "--model", model],
        "predict": ["--model", model, "--out", tmp_path / "out"],
        "explain": ["--model", model, "--out", out],
    }
    done = scenenet(command, path, *options[command])
    assert done.returncode == 1, done.stdout
    errors = [line for line in done.stderr.splitlines() if line.startswith("error:")]
    assert len(errors) == 1 and "degrees.npy" in errors[0] and "look like degrees" in errors[0]
    assert not out.exists()
