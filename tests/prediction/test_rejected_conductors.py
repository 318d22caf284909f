"""Conductors that people rejected, from the list to fill in to the next prediction."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import laspy
import numpy as np
import pyogrio
import pytest
from fixtures.review_files import rows_of, write_rows

PLACE_COLUMNS = ("span", "conductor", "x", "y", "z", "decision", "comment", "reviewer")


@pytest.fixture(scope="module")
def predicted(line_results) -> Path:
    """The folder with a prediction: a line of three spans of one conductor."""
    return line_results.summary.parent


@pytest.fixture
def predict_again(call, line_with_wires, model, wire_finder, tmp_path):
    """Predicts the survey once more with review files; the folder, and what the command said."""

    def predict(*decisions: Path, code: int = 0):
        given = [part for path in decisions for part in ("--decisions", path)]
        done = call(
            "predict", line_with_wires, "--model", model, "--model", wire_finder, "--out",
            tmp_path / "again", "--min-conductor", "0", "--voltage", "66", *given,
        )  # fmt: skip
        assert done.code == code, done.err
        return tmp_path / "again", done

    return predict


def layer(folder: Path, name: str) -> list[dict[str, object]]:
    facts, _, _, values = pyogrio.raw.read(folder / "line.gpkg", layer=name, read_geometry=False)
    rows = zip(*(column.tolist() for column in values), strict=True)
    return [dict(zip(facts["fields"], row, strict=True)) for row in rows]


def fill_in(path: Path, decision: str, **where: str) -> dict[str, str]:
    """Write a decision and a comment into the row with these cells of a CSV file."""
    rows = rows_of(path)
    [row] = [row for row in rows if row.items() >= where.items()]
    row |= {"decision": decision, "comment": "a fence", "reviewer": "Ana"}
    with path.open("w", newline="") as stream:
        table = csv.DictWriter(stream, list(row))
        table.writeheader()
        table.writerows(rows)
    return row


@pytest.fixture
def template(call, predicted, tmp_path) -> Path:
    path = tmp_path / "review.csv"
    done = call("review", predicted, "--template", path)
    assert done.code == 0, done.err
    assert "and 3 conductors" in done.out
    return path


def test_the_list_to_fill_in_has_every_conductor_after_the_towers(predicted, template):
    rows = rows_of(template)
    wires = [row for row in rows if row["conductor"]]
    assert rows[-len(wires) :] == wires
    assert {(row["span"], row["conductor"]) for row in wires} == {
        (row["span_id"], row["conductor_id"]) for row in rows_of(predicted / "line.conductors.csv")
    }
    assert not any(row["decision"] or row["id"] for row in wires)
    doubts = [len(row["doubts"].split("; ")) if row["doubts"] else 0 for row in wires]
    assert doubts == sorted(doubts, reverse=True)


@pytest.mark.parametrize("ending", ["csv", "gpkg"])
def test_a_rejected_conductor_is_gone_from_everything_that_is_predicted_next(
    call, predicted, template, predict_again, tmp_path, ending
):
    before = rows_of(predicted / "line.spans.csv")
    [gone] = [row for row in before if row["order"] == "2"]
    row = fill_in(template, "reject", span=gone["span_id"])
    decisions = template
    if ending == "gpkg":
        decisions = tmp_path / "review.gpkg"
        assert call("review", predicted, "--template", decisions).code == 0
        _reject_feature(decisions, gone["span_id"])
    again, done = predict_again(decisions)
    assert f"rejected, and left out: conductor 1 of span {gone['span_id']}" in done.err
    for name in ("spans", "conductors", "clearances"):
        left = {row["span_id"] for row in rows_of(again / f"line.{name}.csv")}
        assert left == {row["span_id"] for row in before} - {gone["span_id"]}
    for name in ("clearances", "clearance_profile", "fall_trees", "conductors", "spans"):
        assert gone["span_id"] not in {str(row["span_id"]) for row in layer(again, name)}
    assert [str(row["span_id"]) for row in layer(again, "rejected_conductors")] == [gone["span_id"]]
    points = laspy.read(again / "line.laz")
    assert int(gone["span_id"]) not in set(np.asarray(points.span_id).tolist())
    assert gone["span_id"] not in (again / "line.html").read_text("utf-8")
    assert json.loads((again / "line.summary.json").read_text())["line"]["rejected"] == 1
    # The next list to fill in keeps the decision, and finds the conductor by its place.
    following = tmp_path / "following.csv"
    assert call("review", again, "--template", following).code == 0
    last = rows_of(following)[-1]
    assert (last["decision"], last["span"]) == ("reject", gone["span_id"])
    assert (last["x"], last["y"], last["z"]) == (row["x"], row["y"], row["z"])


def _reject_feature(package: Path, span: str) -> None:
    """Reject the conductor of a span in a layer, as a person does in QGIS."""
    facts, _, geometry, values = pyogrio.raw.read(package, layer="review")
    fields = [str(name) for name in facts["fields"]]
    data = dict(zip(fields, values, strict=True))
    data["decision"] = np.where(data["span"] == int(span), "reject", None).astype(object)
    pyogrio.raw.write(
        package, geometry, list(data.values()), fields, layer="review", driver="GPKG",
        geometry_type="Point", crs=facts["crs"],
    )  # fmt: skip


def test_a_review_counts_names_and_keeps_the_decisions(call, predicted, template, tmp_path):
    row = fill_in(template, "reject", conductor="1", span=_spans(predicted)[0])
    fill_in(template, "accept", conductor="1", span=_spans(predicted)[1])
    done = call("review", predicted, "--decisions", template, "--out", tmp_path, "--json")
    assert done.code == 0, done.err
    assert json.loads(done.out)["conductors"] == {
        "found": 3, "accepted": 1, "rejected": 1, "not_reviewed": 1, "comments": 2,
    }  # fmt: skip
    assert f"rejected: conductor 1 of span {row['span']}" in done.err
    (tmp_path / "line.reviewed.gpkg").rename(tmp_path / "line.gpkg")
    [rejected] = layer(tmp_path, "rejected_conductors")
    assert (rejected["decision"], rejected["comment"]) == ("rejected", "a fence")
    kept = layer(tmp_path, "conductors")
    assert sorted(str(row["decision"]) for row in kept) == ["accepted", "not reviewed"]


def _spans(predicted: Path) -> list[str]:
    return [row["span_id"] for row in rows_of(predicted / "line.spans.csv")]


def test_the_place_counts_where_the_numbers_have_changed(call, predicted, template, tmp_path):
    own = fill_in(template, "reject", span=_spans(predicted)[0])
    moved = {**own, "span": 12345, "conductor": 7, "x": float(own["x"]) + 0.2}
    path = write_rows(
        tmp_path / "moved.csv", PLACE_COLUMNS, [[moved[name] for name in PLACE_COLUMNS]]
    )
    done = call("review", predicted, "--decisions", path, "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    assert f"rejected: conductor 1 of span {own['span']}" in done.err


@pytest.mark.parametrize(
    ("cells", "problem"),
    [
        ({"span": 7, "conductor": 1, "decision": "reject"}, "no conductor 1 of a span 7"),
        ({"conductor": 1, "decision": "reject"}, "it names no conductor"),
        ({"span": 7, "conductor": 1, "decision": "add"}, "a conductor cannot be added"),
    ],
)
def test_a_row_that_names_no_conductor_is_an_error_with_its_row(
    call, predicted, predict_again, tmp_path, cells, problem
):
    row = [cells.get(name, "") for name in PLACE_COLUMNS]
    path = write_rows(tmp_path / "wrong.csv", PLACE_COLUMNS, [row])
    done = call("review", predicted, "--decisions", path, "--out", tmp_path / "out")
    assert done.code == 1
    assert "wrong.csv: row 2" in done.err and problem in done.err
    assert not (tmp_path / "out").exists()
    # A prediction goes on: it found this out after all its work.
    again, done = predict_again(path)
    assert "wrong.csv: row 2" in done.err and problem in done.err
    assert len(rows_of(again / "line.conductors.csv")) == 3


def test_a_place_without_a_conductor_is_reported_and_other_rows_count(
    call, predicted, template, predict_again, tmp_path
):
    own = fill_in(template, "reject", span=_spans(predicted)[0])
    beside = {**own, "z": float(own["z"]) + 1.0}
    rows = [[each[name] for name in PLACE_COLUMNS] for each in (beside, own)]
    path = write_rows(tmp_path / "both.csv", PLACE_COLUMNS, rows)
    done = call("review", predicted, "--decisions", path, "--out", tmp_path / "out")
    assert done.code == 0, done.err
    assert "1 rows match no tower or conductor" in done.out
    again, said = predict_again(path)
    for text in (done.err, said.err):
        assert "both.csv: row 2: reject: no conductor was found within 0.5 m" in text
    assert len(rows_of(again / "line.conductors.csv")) == 2


def test_two_files_that_contradict_one_another_reject_nothing(
    call, predicted, template, predict_again, tmp_path
):
    fill_in(template, "reject", span=_spans(predicted)[0])
    other = tmp_path / "other.csv"
    other.write_text(template.read_text().replace("reject", "accept"))
    both = ("--decisions", template, "--decisions", other)
    done = call("review", predicted, *both, "--out", tmp_path / "out")
    assert done.code == 1 and "of the same conductor" in done.err
    again, done = predict_again(template, other)
    assert "of the same conductor" in done.err
    assert len(rows_of(again / "line.conductors.csv")) == 3


def test_decisions_need_a_line_and_files_that_can_be_read(
    call, line_with_wires, model, tmp_path, predict_again
):
    path = tmp_path / "review.csv"
    path.write_text("span,conductor,decision\n1,1,perhaps\n")
    _, done = predict_again(path, code=1)
    assert "'perhaps' is not a decision" in done.err
    path.write_text("span,conductor,decision\n1,1,reject\n")
    done = call(
        "predict", line_with_wires, "--model", model, "--out", tmp_path, "--decisions", path
    )
    assert done.code == 2 and "--decisions" in done.err
