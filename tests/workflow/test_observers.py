"""An observer in the workflow: trained on squares of the training surveys and of one of its own."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
import yaml
from fixtures.project import PARTS, Project, copy_parts

from scenenet.core.files import read_json
from scenenet.models.model_file import read_model

pytestmark = pytest.mark.workflow

MODEL = "results/packaged/wires.json"
TREES = "results/boosted_trees/wires/seed-0.json"
MADE = (MODEL, TREES)
TRAINED = {"train_observer": 1, "tune_observer": 1, "evaluate_observer": 1, "packaged_wires": 1}
GROWN = {"observer_trees": 1}
SQUARES = {"squares": 2, "square_voxels": 2, "square_split": 1}


@pytest.fixture(scope="module")
def made(project_in, project_root: Path, tmp_path_factory) -> Project:
    """A project in which the observer of wires of ``test.yaml`` is trained and packaged."""
    project = project_in(tmp_path_factory.mktemp("observer") / "project")
    copy_parts(project_root, project.folder, PARTS)
    test = yaml.safe_load((project.folder / "config" / "test.yaml").read_text())
    own = {"results_dir": "results", "surveys": "config/surveys.tsv", "studies": []}
    project.configure({**test, **own})
    (project.folder / "config" / "surveys.tsv").write_text("survey\tpath\tcodes\trole\n")
    for name, role in (("first", "train"), ("second", "observe")):
        project.add_row(name, f"{{results_dir}}/synthetic/{name}.laz", "edp", role)
    project.run("--cores", "1", *MADE)
    return project


def test_it_finds_wires_and_is_scored_on_squares_that_it_has_not_seen(made):
    _, card = read_model(made.results / "models" / "wires.json")
    assert (card.target, card.voxel_size) == ("wire", 1.0)
    with (made.results / "square_split/wires/split.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    parts = [row["part"] for row in rows]
    assert {row["survey"] for row in rows} == {"first", "second"}
    scores = read_json(made.results / "evaluate/wires/seed-0.json")
    assert scores["voxel"]["n_samples"] == parts.count("test") > 0
    assert card.provenance["training_crops"] == parts.count("train") > 0
    for against in (scores, scores["truth"]):
        assert against["points"]["n_true"] > 100 and against["points"]["recall"] > 0.3
    assert scores["towers"] is None


def test_boosted_trees_learn_from_the_same_squares_and_are_scored_on_the_same(made):
    trees, observer = (read_json(made.results / of) for of in (
        "boosted_trees/wires/seed-0.json", "evaluate/wires/seed-0.json"
    ))  # fmt: skip
    assert (trees["model"], trees["target"]) == ("boosted trees of wires", "wire")
    for against in ("truth", None):
        one, other = (scores[against] if against else scores for scores in (trees, observer))
        assert [s["id"] for s in one["per_sample"]] == [s["id"] for s in other["per_sample"]]
        assert one["points"]["n_true"] == other["points"]["n_true"]
        assert one["points"]["n_points"] == other["points"]["n_points"]
        assert one["points"]["recall"] > 0.3 and one["points"]["precision"] > 0.3
    assert trees["parameters"] > 1000


def test_without_boosted_trees_an_observer_has_none_beside_it(made):
    table = "results/tables/observers.csv"
    assert "boosted_trees" in made.planned(table)
    made.configure({"boosted_trees": False})
    assert not {"boosted_trees", "observer_trees"} & set(made.planned(table))
    assert made.snakemake("-n", TREES).returncode != 0
    made.configure({"boosted_trees": True})


def test_the_report_shows_every_survey_that_observers_see(made):
    planned = made.planned("results/report/index.html")
    assert (planned["check"], planned["survey_map"], planned["tower_map"]) == (2, 2, 1)


def test_its_card_has_the_points_that_it_found(made):
    card = (made.results / "packaged" / "wires.md").read_text(encoding="utf-8")
    truth = read_json(made.results / "evaluate/wires/seed-0.json")["truth"]["points"]
    assert f"| against the truth | {truth['precision']:.2f} | {truth['recall']:.2f} |" in card


def test_models_of_towers_do_not_see_the_surveys_of_observers(made):
    planned = made.planned("results/split/split.csv")
    assert (planned["towers"], planned["crops"]) == (1, 1)


def test_what_runs_again_is_what_depends_on_a_change(made):
    assert made.planned(*MADE) == {}
    made.add_row("own", "{results_dir}/synthetic/third.laz", "edp", "new")
    assert made.planned(*MADE) == {}
    observer = {"name": "wires", "target": "wire", "voxel_size": 1}
    made.configure({"observers": [{**observer, "changes": {"search.starts": 3}}]})
    assert made.planned(*MADE) == TRAINED
    equal = {"search.starts": 2, "metric.false_weight": 0.25}
    made.configure({"observers": [{**observer, "changes": equal}]})
    assert made.planned(*MADE) == {**TRAINED, **GROWN}
    usual = {**observer, "changes": {"search.starts": 2}}
    shares = {"train": 0.5, "validation": 0.2, "test": 0.3, "stretch": 1}
    made.configure({"observers": [{**usual, "split": shares}]})
    assert made.planned(*MADE) == {"square_split": 1, **TRAINED, **GROWN}
    made.configure(
        {"observers": [{**observer, "changes": {"search.starts": 2}, "square": {"edge": 40}}]}
    )
    assert made.planned(*MADE) == {**SQUARES, **TRAINED, **GROWN}
