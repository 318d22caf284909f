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
TRAINED = {"train_observer": 1, "tune_observer": 1, "evaluate_observer": 1, "packaged_wires": 1}
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
    project.run("--cores", "1", MODEL)
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


def test_its_card_has_the_points_that_it_found(made):
    card = (made.results / "packaged" / "wires.md").read_text(encoding="utf-8")
    truth = read_json(made.results / "evaluate/wires/seed-0.json")["truth"]["points"]
    assert f"| against the truth | {truth['precision']:.2f} | {truth['recall']:.2f} |" in card


def test_models_of_towers_do_not_see_the_surveys_of_observers(made):
    planned = made.planned("results/split/split.csv")
    assert (planned["towers"], planned["crops"]) == (1, 1)


def test_what_runs_again_is_what_depends_on_a_change(made):
    assert made.planned(MODEL) == {}
    made.add_row("own", "{results_dir}/synthetic/third.laz", "edp", "new")
    assert made.planned(MODEL) == {}
    observer = {"name": "wires", "target": "wire", "voxel_size": 1}
    made.configure({"observers": [{**observer, "changes": {"search.starts": 3}}]})
    assert made.planned(MODEL) == TRAINED
    usual = {**observer, "changes": {"search.starts": 2}}
    shares = {"train": 0.5, "validation": 0.2, "test": 0.3, "stretch": 1}
    made.configure({"observers": [{**usual, "split": shares}]})
    assert made.planned(MODEL) == {"square_split": 1, **TRAINED}
    made.configure(
        {"observers": [{**observer, "changes": {"search.starts": 2}, "square": {"edge": 40}}]}
    )
    assert made.planned(MODEL) == {**SQUARES, **TRAINED}
