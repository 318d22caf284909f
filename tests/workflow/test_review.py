"""What people decide about the towers of a new survey becomes its reviewed list."""

from __future__ import annotations

import csv
import shutil

import pytest

from scenenet.core.files import read_json

pytestmark = pytest.mark.workflow


def test_the_list_to_fill_in_has_every_tower(finished):
    with (finished.results / "review/own/own.template.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    with (finished.results / "predict/own/own.towers.csv").open(newline="") as stream:
        towers = list(csv.DictReader(stream))
    assert {row["id"] for row in rows} == {tower["id"] for tower in towers}
    assert not any(row["decision"] for row in rows)


def test_decisions_are_in_the_reviewed_list_and_in_the_report(finished):
    with (finished.results / "review/own/own.reviewed.csv").open(newline="") as stream:
        decisions = [row["decision"] for row in csv.DictReader(stream)]
    assert decisions.count("added") == 1
    page = (finished.results / "report/index.html").read_text(encoding="utf-8")
    assert "1 added" in page


def test_a_changed_review_file_makes_its_list_and_the_report(project):
    decisions = project.folder / "reviews" / "own.csv"
    decisions.write_text(decisions.read_text() + "544905,4633995,add\n")
    assert project.planned() == {"review": 1, "report": 1}
    project.run()
    record = read_json(project.results / "review/own/own.reviewed.json")
    assert record["counts"]["added"] == 2
    assert "Nothing to be done" in project.run()


def test_several_files_are_merged_and_a_file_of_no_survey_is_named(project):
    reviews = project.folder / "reviews"
    (reviews / "own.second.csv").write_text("x,y,decision\n544905,4633995,add\n")
    (reviews / "wrong.csv").write_text("x,y,decision\n")
    shown = project.run("results/review/own/own.reviewed.json")
    assert (
        "left out: reviews/wrong.csv: its name does not begin with that of a new survey (own)"
        in shown
    )
    record = read_json(project.results / "review/own/own.reviewed.json")
    assert record["decisions"] == ["reviews/own.csv", "reviews/own.second.csv"]
    assert record["counts"]["added"] == 2


def test_rows_that_cannot_be_used_are_all_named(project):
    decisions = project.folder / "reviews" / "own.csv"
    decisions.write_text("id,x,y,decision\n7,,,accept\n,,,add\n")
    done = project.snakemake("results/review/own/own.reviewed.json")
    assert done.returncode != 0
    log = (project.results / "logs/review/own.log").read_text()
    assert log.startswith("Error: 2 decisions cannot be used, so none was applied:")
    assert "reviews/own.csv: row 2" in log and "reviews/own.csv: row 3" in log
    assert "Traceback" not in log


def test_without_review_files_there_is_a_list_to_fill_in_alone(project):
    shutil.rmtree(project.folder / "reviews")
    assert "review" not in project.planned("--forceall")
