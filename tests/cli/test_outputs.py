"""No command destroys a file: not an input, not a model, not the result of anything else."""

from __future__ import annotations

import json
import re
import resource
import shutil
import tempfile

import laspy
import pytest

from scenenet.core.errors import OutputError
from scenenet.core.outputs import check_outputs
from scenenet.pointcloud import survey_info
from scenenet.prediction.result_files import PredictionFiles


def test_another_survey_of_the_same_name_is_not_replaced(call, pole_survey, pole_model):
    folder = pole_survey.parent
    other = folder / "tile.laz"
    shutil.copy(pole_survey, other)
    shutil.copy(pole_survey, folder / "tile.copc.laz")
    before = other.read_bytes()
    done = call("predict", folder / "tile.copc.laz", "--model", pole_model, "--out", folder)
    assert done.code == 1
    assert "tile.laz: this file exists" in done.err
    assert "--overwrite" in done.err
    assert other.read_bytes() == before
    assert not list(folder.glob("*.summary.json"))
    assert done.out == ""


def test_two_surveys_never_share_a_result(call, pole_survey, pole_model, tmp_path):
    second = pole_survey.with_name("field.copc.laz")
    shutil.copy(pole_survey, second)
    out = tmp_path / "out"
    done = call("predict", pole_survey, second, "--model", pole_model, "--out", out, "--overwrite")
    assert done.code == 1
    assert "field.laz" in done.err
    assert "field.copc.laz" in done.err
    assert "would both be written" in done.err
    assert not out.exists()


@pytest.mark.parametrize("link", ["symlink_to", "hardlink_to"])
def test_an_input_is_never_replaced_even_through_a_link(
    call, pole_survey, pole_model, tmp_path, link
):
    out = tmp_path / "out"
    out.mkdir()
    getattr(out / "field.laz", link)(pole_survey)
    before = pole_survey.read_bytes()
    done = call("predict", pole_survey, "--model", pole_model, "--out", out, "--overwrite")
    assert done.code == 1
    assert "is an input" in done.err
    assert pole_survey.read_bytes() == before


def test_an_unchanged_prediction_is_replaced_and_a_changed_one_is_not(
    call, pole_survey, pole_model, tmp_path
):
    out = tmp_path / "out"
    predict = ("predict", pole_survey, "--model", pole_model, "--out", out)
    assert call(*predict).code == 0
    assert call(*predict).code == 0
    summary = json.loads((out / "field.summary.json").read_text())
    assert set(summary["outputs"]) == {
        "field.laz", "field.gpkg", "field.html", "field.towers.csv", "field.towers.geojson",
    }  # fmt: skip
    edited = laspy.read(out / "field.laz")
    edited.classification[:] = 1
    edited.write(out / "field.laz")
    before = (out / "field.laz").read_bytes()
    refused = call(*predict)
    assert refused.code == 1
    assert "field.laz: this file exists" in refused.err
    assert (out / "field.laz").read_bytes() == before
    assert call(*predict, "--overwrite").code == 0
    assert (out / "field.laz").read_bytes() != before


def test_a_prediction_without_its_record_is_not_replaced(call, pole_survey, pole_model, tmp_path):
    out = tmp_path / "out"
    predict = ("predict", pole_survey, "--model", pole_model, "--out", out)
    assert call(*predict).code == 0
    (out / "field.summary.json").unlink()
    assert call(*predict).code == 1


@pytest.mark.parametrize("target", ["field.laz", "by-hand.json", "notes.html"])
def test_explain_replaces_only_explanations(call, pole_survey, pole_model, tmp_path, target):
    pytest.importorskip("matplotlib")
    page = tmp_path / target
    if not page.exists():
        page.write_text("<html>my own notes</html>")
    before = page.read_bytes()
    assert call("explain", pole_survey, "--model", pole_model, "--out", page).code in (1, 2)
    assert page.read_bytes() == before


def test_an_explanation_is_replaced_by_the_next(call, pole_survey, pole_model, tmp_path):
    explain = ("explain", pole_survey, "--model", pole_model, "--out", tmp_path / "page.html")
    assert [call(*explain).code for _ in range(2)] == [0, 0]


def test_synth_replaces_only_synthetic_surveys(call, pole_survey, tmp_path):
    before = pole_survey.read_bytes()
    done = call("synth", pole_survey, "--towers", 1)
    assert done.code == 1
    assert "field.laz: this file exists" in done.err
    assert pole_survey.read_bytes() == before
    made = tmp_path / "made.laz"
    assert [call("synth", made, "--towers", 1, "--seed", seed).code for seed in (0, 1)] == [0, 0]
    done = call("synth", made, "--towers", 1, "--truth", made)
    assert done.code == 1
    assert "would both be written" in done.err


def test_train_replaces_only_models(call, pole_survey, tmp_path):
    other = tmp_path / "towers.json"
    other.write_text("[]")
    done = call("train", pole_survey, "--codes", "edp", "--out", other)
    assert done.code == 1
    assert "towers.json: this file exists" in done.err
    assert other.read_text() == "[]"


@pytest.mark.parametrize("name", ["results", "results/deep"])
def test_a_result_folder_that_is_a_file_is_named_before_the_work(
    call, pole_survey, pole_model, tmp_path, name
):
    (tmp_path / "results").write_text("a file")
    done = call("predict", pole_survey, "--model", pole_model, "--out", tmp_path / name)
    assert done.code == 1
    assert "results: this is a file, not a folder" in done.err
    assert "chunks read" not in done.err


@pytest.mark.parametrize("command", ["predict", "explain", "train", "evaluate", "synth"])
def test_too_little_space_is_said_before_the_work(
    call, pole_survey, pole_model, tmp_path, monkeypatch, command
):
    if command == "explain":
        pytest.importorskip("matplotlib")
    monkeypatch.setattr("scenenet.core.outputs.free_space", lambda path: 1000)
    out = tmp_path / {"synth": "made.laz", "explain": "page.html", "train": "m.json"}.get(
        command, "out"
    )
    done = call(command, *{
        "predict": (pole_survey, "--model", pole_model, "--out", out),
        "explain": (pole_survey, "--model", pole_model, "--out", out),
        "train": (pole_survey, "--codes", "edp", "--out", out),
        "evaluate": (pole_survey, "--model", pole_model, "--codes", "edp"),
        "synth": (out, "--towers", 1),
    }[command])  # fmt: skip
    assert done.code == 1
    place = str(out if command in ("predict", "explain", "synth") else tempfile.gettempdir())
    assert f"error: {place}" in done.err
    assert "MB are needed, and 0.0 MB are free" in done.err
    assert "chunks read" not in done.err and "made" not in done.out
    assert not out.exists()


def test_a_file_that_cannot_grow_ends_with_a_message_and_no_result(
    call, pole_survey, pole_model, tmp_path
):
    out = tmp_path / "out"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        done = call("predict", pole_survey, "--model", pole_model, "--out", out)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert done.code == 1
    assert "cannot be written" in done.err
    assert "limit on file sizes" in done.err
    assert not re.search(r"/\.field\.", done.err)
    assert "Traceback" not in done.err
    assert not [path for path in out.rglob("*") if path.is_file()]


def test_copc_without_pdal_is_refused_before_the_work(
    call, pole_survey, pole_model, tmp_path, monkeypatch
):
    monkeypatch.setenv("PATH", str(tmp_path))
    out = tmp_path / "out"
    done = call("predict", pole_survey, "--model", pole_model, "--out", out, "--copc")
    assert done.code == 1
    assert done.err.startswith("error: --copc needs the program pdal, which is not on PATH")
    assert not out.exists()


def test_copc_is_written_beside_the_points(call, pole_survey, pole_model, tmp_path):
    if shutil.which("pdal") is None:
        pytest.skip("no pdal here: install PDAL to test the conversion itself")
    out = tmp_path / "out"
    for _ in range(2):  # the second run replaces the results of the first
        done = call("predict", pole_survey, "--model", pole_model, "--out", out, "--copc")
        assert done.code == 0, done.err
    assert survey_info(out / "field.copc.laz").n_points == survey_info(out / "field.laz").n_points


def test_a_copc_file_of_another_origin_is_not_replaced(pole_survey, tmp_path):
    files = PredictionFiles.of(pole_survey, tmp_path / "out", copc=True)
    [copc] = [o.path for o in files.outputs() if o.path.name == "field.copc.laz"]
    copc.parent.mkdir()
    copc.write_bytes(b"mine")
    with pytest.raises(OutputError, match=r"field\.copc\.laz: this file exists"):
        check_outputs(files.outputs(), [pole_survey])
