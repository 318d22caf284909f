"""Wires that models find in whole synthetic surveys, from the command to the table."""

from __future__ import annotations

import shutil

import pytest

from scenenet.experiments import wires_in_surveys
from scenenet.experiments.wires_in_surveys import LINES, Scored, lines_of, main, table
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.packaged import WIRES, packaged_model


def _cells(row: str) -> list[str]:
    return [cell.strip() for cell in row.strip("|").split("|")]


def test_each_line_has_a_seed_of_its_own_whichever_are_chosen():
    lines = lines_of(40)
    assert list(lines) == list(LINES)
    assert [of.seed for of in lines.values()] == list(range(40, 48))
    assert {of.other_lines for of in lines.values()} == {14}
    assert {of.other_lines for of in lines_of(40, 0).values()} == {0}
    pylons = [(*of.kinds, of.bundle) for name, of in lines.items() if name[-1].isdigit()]
    assert pylons == [("lattice", 1), ("lattice", 2), ("lattice", 4), ("window", 2), ("window", 1)]


def test_a_line_is_scored_with_each_model(tmp_path, monkeypatch, capsys):
    short = {"towers": 2, "density": 20, "section": 0, "margin": 20.0}
    monkeypatch.setattr(wires_in_surveys, "LINES", {"poles": short})
    again = shutil.copy(packaged_model(WIRES), tmp_path / "again.json")
    assert main(["--model", str(packaged_model(WIRES)), str(again), "--seed", "3"]) == 0
    head, _, row, mean = capsys.readouterr().out.strip().splitlines()
    assert _cells(head)[5:8] == [
        "wires: precision, recall",
        "wires: IoU",
        "again: precision, recall",
    ]
    _, _, pulses, _, _, first, iou, second, same, trivial = _cells(row)
    assert pulses == "20" and (first, iou) == (second, same)
    assert min(float(score) for score in first.split(", ")) > 0.7
    assert 0 < float(trivial) < 0.1 < float(iou)
    assert _cells(mean)[-5:] == ["", iou, "", same, trivial]


def test_a_model_that_cannot_be_used_is_an_error_with_its_name(tmp_path, capsys):
    assert main(["--model", str(tmp_path / "none.json"), "--lines", "wooden"]) == 1
    assert "none.json" in capsys.readouterr().err


def test_the_table_has_the_scores_the_trivial_answer_and_the_means():
    settings = lines_of(0)["wooden"]
    rows = [
        Scored("wooden", settings, (Confusion(3, 1, 1, 5), Confusion(0, 0, 4, 6))),
        Scored("wooden", settings, (Confusion(4, 0, 0, 6), Confusion(2, 2, 2, 4))),
    ]
    *_, first, _, mean = table(rows, ["one", "other"])
    assert _cells(first)[5:] == ["0.75, 0.75", "0.60", "0.00, 0.00", "0.00", "0.40"]
    assert _cells(mean)[5:] == ["", "0.80", "", "0.17", "0.40"]


@pytest.mark.parametrize("name", LINES)
def test_every_line_is_possible(name):
    assert lines_of(0)[name].towers >= 4
