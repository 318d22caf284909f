"""``scenenet predict`` with ``--voltage``, ``--limits`` and ``--sags``."""

from __future__ import annotations

import csv
import json
import sqlite3

import pytest
from fixtures.scenes import model_card

from scenenet.models.model_file import read_model, write_model
from scenenet.models.packaged import WIRES, packaged_model

LIMITS = "voltage,ground,vegetation,building,wire\n30,5,2,3,2\n"


@pytest.fixture(scope="module")
def wire_model(tmp_path_factory, pole_finder):
    """A model of wires that responds to poles."""
    path = tmp_path_factory.mktemp("wire") / "wire.json"
    write_model(path, pole_finder[0], model_card(name="wires", target="wire", tau=0.5))
    return path


def message_of(done) -> str:
    return " ".join(done.err.replace("│", " ").split())


@pytest.mark.parametrize(
    ("options", "code", "problem"),
    [
        (("--limits", "limits.csv"), 2, "needs --voltage"),
        (("--voltage", "66"), 2, "or a model of towers and one of target wire"),
        (("--voltage", "1500"), 1, "there are no limits for 1500 kV"),
        (("--voltage", "66", "--limits", "limits.csv"), 1, "highest voltage of the table is 30 kV"),
        (("--voltage", "66", "--limits", "none.csv"), 1, "none.csv: cannot be read"),
        (("--voltage", "0"), 2, "--voltage"),
        (("--sags", "sags.csv"), 2, "or a model of towers and one of target wire"),
        (("--line", "--sags", "limits.csv"), 1, "limits.csv: has no column span, c"),
    ],
)
def test_limits_that_cannot_be_used_stop_the_command(
    call, pole_survey, pole_model, tmp_path, options, code, problem
):
    (tmp_path / "limits.csv").write_text(LIMITS)
    (tmp_path / "sags.csv").write_text("span,c\n1,900\n")
    named = [str(tmp_path / o) if o.endswith(".csv") else o for o in options]
    done = call("predict", pole_survey, "--model", pole_model, "--out", tmp_path / "out", *named)
    assert done.code == code
    assert problem in message_of(done)
    assert not (tmp_path / "out").exists()


def test_a_prediction_of_lines_has_clearances(call, pole_survey, pole_model, wire_model, tmp_path):
    (tmp_path / "limits.csv").write_text(LIMITS)
    done = call(
        "predict", pole_survey, "--model", pole_model, "--model", wire_model, "--out",
        tmp_path / "out", "--codes", "edp", "--voltage", "30", "--limits", tmp_path / "limits.csv",
        "--min-conductor", "0", "--json",
    )  # fmt: skip
    assert done.code == 0, done.err
    [summary] = json.loads(done.out)
    counts = summary["line"]["clearances"]
    assert counts["limits"] == "30 kV: limits.csv"
    assert counts["kinds"].startswith("from classes edp")
    assert summary["settings"]["clearance"]["voltage"] == 30
    name = pole_survey.stem
    table = tmp_path / "out" / f"{name}.clearances.csv"
    assert table.name in summary["outputs"]
    with table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == summary["line"]["spans"]
    with sqlite3.connect(tmp_path / "out" / f"{name}.gpkg") as database:
        layers = {row[0] for row in database.execute("SELECT table_name FROM gpkg_contents")}
        styled = {row[0] for row in database.execute("SELECT f_table_name FROM layer_styles")}
    assert {"clearances", "fall_trees", "clearance_profile"} <= layers & styled


def test_line_adds_the_model_of_wires_of_the_package_unless_one_is_named(
    call, pole_survey, pole_model, wire_model, tmp_path
):
    def wires(*options):
        done = call("predict", pole_survey, "--line", "--out", tmp_path / "out", "--json",
                    "--min-conductor", "0", "--overwrite", *options)  # fmt: skip
        assert done.code == 0, done.err
        [summary] = json.loads(done.out)
        assert summary["line"] is not None
        tower, wire = summary["targets"]
        return tower["model"], wire["tau"]

    own = read_model(packaged_model(WIRES))[1].threshold()
    assert wires("--model", pole_model) == ("by-hand", own)
    assert wires("--model", pole_model, "--model", wire_model) == ("by-hand", 0.5)
    assert (tmp_path / "out" / f"{pole_survey.stem}.spans.csv").exists()


def test_a_model_of_the_package_has_a_name_and_lines_need_towers(call, pole_survey, tmp_path):
    done = call("predict", pole_survey, "--line", "--model", "wires", "--out", tmp_path / "out")
    assert done.code == 2
    assert "needs a model of towers" in message_of(done)
