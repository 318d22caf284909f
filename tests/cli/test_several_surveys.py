"""A bad survey among several stops no other."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pyogrio
import pytest


@pytest.fixture
def three(pole_survey):
    """A good survey, a bad one and a good one."""
    bad, good2 = pole_survey.with_name("bad.laz"), pole_survey.with_name("good2.laz")
    bad.write_bytes(b"no survey")
    shutil.copy(pole_survey, good2)
    return pole_survey, bad, good2


def test_the_surveys_after_a_bad_one_are_predicted(call, three, pole_model, tmp_path):
    done = call("predict", *three, "--model", pole_model, "--out", tmp_path / "out", "--json")
    assert done.code == 1
    assert [entry["points"] > 0 for entry in json.loads(done.out)] == [True, True]
    assert {path.stem for path in (tmp_path / "out").glob("*.laz")} == {"field", "good2"}
    errors = [line for line in done.err.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert "bad.laz" in errors[0]


def test_the_line_of_a_survey_says_which_files_failed_and_what_to_open(
    call, three, pole_model, tmp_path
):
    good, bad, _ = three
    tiles, out = tmp_path / "tiles", tmp_path / "out"
    tiles.mkdir()
    for path in (good, bad):
        shutil.copy(path, tiles)
    done = call("predict", tiles, good, "--model", pole_model, "--out", out)
    assert done.code == 1
    tiled, one = done.out.splitlines()
    assert "1 of 2 files predicted, 1 failed" in tiled and "files predicted" not in one
    assert f"open {out / 'tiles.html'}; of each file: {out / 'tiles' / 'status.csv'}" in tiled
    assert one.endswith(f"open {out / 'field.html'}")
    for path in (out / "tiles.html", out / "tiles" / "status.csv", out / "field.html"):
        assert path.exists()


def test_where_every_survey_fails_nothing_is_printed(call, three, pole_model, tmp_path):
    done = call("predict", three[1], "--model", pole_model, "--out", tmp_path / "out")
    assert done.code == 1 and done.out == ""
    assert call("check", three[1]).out == ""


def test_check_names_each_file_by_its_path(call, three):
    good, _, good2 = three
    shown = call("check", good, good2).out
    assert [f"{path}: LAZ" in shown for path in (good, good2)] == [True, True]


def test_a_survey_damaged_in_its_points_stops_no_other(call, three, pole_model, tmp_path):
    good, bad, _ = three
    whole = good.read_bytes()
    bad.write_bytes(whole[: len(whole) // 2])
    done = call("predict", bad, good, "--model", pole_model, "--out", tmp_path / "out")
    assert done.code == 1
    assert (tmp_path / "out" / "field.laz").exists()
    assert not (tmp_path / "out" / "bad.laz").exists()


def test_the_files_after_a_bad_one_are_scored(call, three, pole_model):
    done = call("evaluate", *three, "--model", pole_model, "--codes", "edp", "--json")
    assert done.code == 1
    assert json.loads(done.out)["voxel"]["n_samples"] == 2
    assert "bad.laz" in done.err


def test_bad_files_alone_are_named_one_by_one(call, tmp_path, pole_model):
    names = [tmp_path / "a.laz", tmp_path / "b.laz"]
    done = call("evaluate", *names, "--model", pole_model, "--codes", "edp")
    assert done.code == 1
    assert [f"{name}" in done.err for name in names] == [True, True]


@pytest.fixture
def index(three, tmp_path):
    """A GeoPackage that lists the three surveys, and one that is not there."""
    names = [*(path.name for path in three), "gone.laz"]
    pyogrio.raw.write(
        tmp_path / "index.gpkg", layer="tindex", driver="GPKG", geometry=None, geometry_type=None,
        field_data=[np.array(names, object)], fields=["location"],
    )  # fmt: skip
    return tmp_path / "index.gpkg"


def test_the_files_of_an_index_are_checked_one_by_one(call, index, three):
    done = call("check", index, "--json")
    assert done.code == 1
    assert [report["survey"] for report in json.loads(done.out)] == ["field.laz", "good2.laz"]
    errors = [line for line in done.err.splitlines() if line.startswith("error: ")]
    assert ["bad.laz" in errors[0], "gone.laz" in errors[1], len(errors)] == [True, True, 2]
    folder = call("check", three[0].parent, "--json")
    assert folder.code == 1
    assert len(json.loads(folder.out)) == 2


def test_failed_files_of_an_index_give_the_exit_code_and_a_table(call, index, pole_model, tmp_path):
    done = call("predict", index, "--model", pole_model, "--out", tmp_path / "out", "--json")
    assert done.code == 1
    assert "bad.laz" in done.err and "gone.laz" in done.err
    status = (tmp_path / "out" / "index" / "status.csv").read_text().splitlines()
    assert status[0] == "file,status,points,towers,tower_points,error"
    assert [row.split(",")[:2] for row in status[1:]] == [
        ["field.laz", "predicted"], ["bad.laz", "failed"], ["good2.laz", "predicted"],
        ["gone.laz", "failed"],
    ]  # fmt: skip


def test_an_index_is_never_replaced(call, index, pole_model):
    before = index.read_bytes()
    done = call("predict", index, "--model", pole_model, "--out", index.parent, "--overwrite")
    assert done.code == 1
    assert "this file is an input" in done.err
    assert index.read_bytes() == before
