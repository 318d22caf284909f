"""A copy of the project in which the workflow has run once, and copies of that to change."""

from __future__ import annotations

import fcntl
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml

PARTS = ("Snakefile", "profiles", "workflow", "config")
PACKAGE = "scenenet"
RUN_LIMIT_S = 1800


@dataclass(frozen=True)
class Project:
    """A folder with the workflow.

    Attributes:
        folder: its root.
        package: the folder that holds the package that snakemake and its jobs import.
        shown: what the first run wrote to the terminal.
    """

    folder: Path
    package: Path
    shown: str = ""

    @property
    def results(self) -> Path:
        return self.folder / "results"

    def snakemake(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Call snakemake here."""
        return subprocess.run(
            [sys.executable, "-m", "snakemake", *arguments],
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": str(self.package)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=RUN_LIMIT_S,
            check=False,
        )

    def run(self, *arguments: str) -> str:
        done = self.snakemake(*arguments)
        assert done.returncode == 0, done.stdout
        return done.stdout

    def planned(self, *arguments: str) -> dict[str, int]:
        """Rule -> number of jobs that a run would have; empty if everything is up to date."""
        shown = self.run("-n", *arguments)
        if "Nothing to be done" in shown:
            return {}
        table = shown.partition("Job stats:")[2].partition("total")[0]
        counts = re.findall(r"^(\w+) +(\d+)$", table, re.MULTILINE)
        assert counts, shown
        return {rule: int(count) for rule, count in counts if rule != "all"}

    def refused(self, *arguments: str) -> str:
        """The error message of a call that must not start any job."""
        done = self.snakemake("-n", *arguments)
        assert done.returncode != 0
        assert "Job stats" not in done.stdout
        return done.stdout

    def configure(self, settings: dict[str, Any]) -> None:
        """Change settings of the configuration, named with dots."""
        file = self.folder / "config" / "config.yaml"
        config = yaml.safe_load(file.read_text())
        for name, value in settings.items():
            *groups, key = name.split(".")
            inside = config
            for group in groups:
                inside = inside.setdefault(group, {})
            inside[key] = value
        file.write_text(yaml.safe_dump(config))

    def configured(self, name: str) -> Any:
        """A setting as the configuration has it."""
        return yaml.safe_load((self.folder / "config" / "config.yaml").read_text())[name]

    def edit(self, path: str, old: str, new: str) -> None:
        """Replace a text that occurs once in a file."""
        file = self.folder / path
        text = file.read_text()
        assert text.count(old) == 1, f"{old!r} occurs {text.count(old)} times in {path}"
        file.write_text(text.replace(old, new))

    def add_row(self, *cells: str) -> None:
        with (self.folder / "config" / "surveys.tsv").open("a") as sheet:
            sheet.write("\t".join(cells) + "\n")


@pytest.fixture(scope="session")
def project_in(project_root: Path) -> Callable[[Path], Project]:
    """A function that gives the project in a folder, with the package of the repository."""
    return lambda folder: Project(folder, package=project_root)


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey that the workflow did not generate."""
    from scenenet.synthetic import SyntheticSettings, make_survey

    path = tmp_path_factory.mktemp("recorded") / "own.laz"
    make_survey(SyntheticSettings(towers=2, seed=9, density=4), path)
    return path


@pytest.fixture(scope="session")
def finished(tmp_path_factory, project_root, recorded) -> Project:
    """The workflow after its first run: two synthetic surveys to train on and a recorded one that
    is only classified. Not to be changed; take ``project`` for that.

    All workers of a test run share it: the first one runs it, the others wait.
    """
    shared = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        shared = shared.parent
    folder, shown = shared / "finished" / "project", shared / "finished" / "shown.txt"
    with (shared / "finished.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not shown.exists():
            # It uses the package of the repository, which may be compiled already. The tests change
            # a copy. Nothing runs again because of the copy: digests are those of the content.
            first = Project(folder, package=project_root)
            _copy(project_root, folder, PARTS)
            _configure(first, recorded)
            text = first.run()
            _copy(project_root, folder, [PACKAGE])
            shown.write_text(text, encoding="utf-8")
    return Project(folder, package=folder, shown=shown.read_text(encoding="utf-8"))


def _copy(root: Path, folder: Path, names: Iterable[str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        source = root / name
        if source.is_dir() and not source.is_symlink():
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(source, folder / name, ignore=ignored)
        else:
            shutil.copy2(source, folder / name, follow_symlinks=False)


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


def _tiny(test: dict[str, Any]) -> dict[str, Any]:
    """The small configuration, without its new survey and with an inbox."""
    test["synthetic"]["surveys"] = test["synthetic"]["surveys"][:2]
    own = {"results_dir": "results", "surveys": "config/surveys.tsv", "dataset": "tiny"}
    return {**test, **own, "new_surveys": {"folder": "surveys", "codes": "edp"}}


@pytest.fixture(scope="session")
def copied(finished, tmp_path_factory) -> Callable[[], Project]:
    """A function that copies the finished project, dates included."""

    def copy() -> Project:
        folder = tmp_path_factory.mktemp("copied") / "project"
        subprocess.run(["cp", "-a", str(finished.folder), str(folder)], check=True)
        return Project(folder, package=folder)

    return copy


@pytest.fixture
def project(copied) -> Project:
    """A copy of the finished project to change and plan again."""
    return copied()
