"""A copy of the project in which the workflow has run once, and copies of that to change."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from fixtures.made_once import made_once
from fixtures.project import PACKAGE, PARTS, Project, copy_parts

DATASET = ("split", "voxels")
AS_USERS = "results/train/scenenet/seed-0/resources.json"
ALONE = ("--cores", "1")
BESIDE_THE_LINE = (544_905.0, 4_633_970.0)
"""x and y, m, of a tower that a person adds to the recorded survey."""


@pytest.fixture(scope="session")
def project_in(project_root: Path) -> Callable[[Path], Project]:
    """A function that gives the project in a folder, with the package of the repository."""
    return lambda folder: Project(folder, package=project_root, forked=True)


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey that the workflow did not generate."""
    from scenenet.synthetic import SyntheticSettings, make_survey

    settings = SyntheticSettings(towers=2, seed=9, density=4)
    folder = made_once(
        tmp_path_factory, "recorded", lambda made: make_survey(settings, made / "own.laz")
    )
    return folder / "own.laz"


@pytest.fixture(scope="session")
def finished(tmp_path_factory, project_root, recorded, empty_database) -> Project:
    """The workflow after its first run: two synthetic surveys to train on and a recorded one that
    is only classified. Its store of MLflow was there, with no runs; ``test_module`` has one made.
    Not to be changed; take ``project`` for that."""

    def make(shared: Path) -> None:
        # It uses the package of the repository, which may be compiled already. The tests change
        # a copy. Nothing runs again because of the copy: digests are those of the content.
        folder = shared / "project"
        first = Project(folder, package=project_root, forked=True)
        copy_parts(project_root, folder, PARTS)
        _configure(first, recorded)
        shutil.copyfile(empty_database, folder / "mlflow.db")
        # One job at a time, because another worker of the tests has the other core, and two jobs
        # would compile the same functions at the same time.
        text = first.run(*ALONE, "--until", *DATASET)
        # One training runs as users run it: it records the memory of a process of its own.
        trained = first.call(*ALONE, AS_USERS)
        assert trained.returncode == 0, trained.stdout
        text += trained.stdout + first.run(*ALONE)
        copy_parts(project_root, folder, [PACKAGE])
        (shared / "shown.txt").write_text(text, encoding="utf-8")

    shared = made_once(tmp_path_factory, "finished", make)
    folder, shown = shared / "project", (shared / "shown.txt").read_text(encoding="utf-8")
    return Project(folder, package=folder, shown=shown, forked=True)


def _configure(project: Project, recorded: Path) -> None:
    test = project.folder / "config" / "test.yaml"
    project.configure(_tiny(yaml.safe_load(test.read_text())))
    sheet = project.folder / "config" / "surveys.tsv"
    sheet.write_text("survey\tpath\tcodes\trole\n")
    for name in ("first", "second"):
        project.add_row(name, f"{{results_dir}}/synthetic/{name}.laz", "edp", "train")
    project.add_row("own", "data/own.laz", "edp", "new")
    (project.folder / "data").mkdir()
    shutil.copyfile(recorded, project.folder / "data" / "own.laz")
    (project.folder / "reviews").mkdir()
    x, y = BESIDE_THE_LINE
    (project.folder / "reviews" / "own.csv").write_text(f"x,y,decision\n{x},{y},add\n")


def _tiny(test: dict[str, Any]) -> dict[str, Any]:
    """The small configuration, without its new survey and its observer (``test_observers``), and
    with an inbox."""
    test["synthetic"]["surveys"] = test["synthetic"]["surveys"][:2]
    test["observers"], test["predict"]["observers"] = [], []
    own = {"results_dir": "results", "surveys": "config/surveys.tsv", "dataset": "tiny"}
    return {**test, **own, "new_surveys": {"folder": "surveys", "codes": "edp"}}


@pytest.fixture(scope="session")
def copied(finished, tmp_path_factory) -> Callable[[], Project]:
    """A function that copies the finished project, dates included."""

    def copy() -> Project:
        folder = tmp_path_factory.mktemp("copied") / "project"
        subprocess.run(["cp", "-a", str(finished.folder), str(folder)], check=True)
        return Project(folder, package=folder, forked=True)

    return copy


@pytest.fixture
def project(copied) -> Project:
    """A copy of the finished project to change and plan again."""
    return copied()
