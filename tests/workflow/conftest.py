"""A copy of the project in which the workflow has run once, and copies of that to change."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml

PARTS = ("Snakefile", "profiles", "workflow", "config", "scenenet")
RUN_LIMIT_S = 900


@dataclass(frozen=True)
class Project:
    """A folder with the workflow in it, as a user has it.

    Attributes:
        folder: its root.
        shown: what the first run wrote to the terminal.
    """

    folder: Path
    shown: str = ""

    @property
    def results(self) -> Path:
        return self.folder / "results"

    def snakemake(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Call snakemake here; it and its jobs import the package of this folder."""
        return subprocess.run(
            [sys.executable, "-m", "snakemake", *arguments],
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": str(self.folder)},
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
        """Rule -> number of jobs that a run would have; empty where nothing is to be done."""
        shown = self.run("-n", *arguments)
        if "Nothing to be done" in shown:
            return {}
        table = shown.partition("Job stats:")[2].partition("total")[0]
        counts = re.findall(r"^(\w+) +(\d+)$", table, re.MULTILINE)
        assert counts, shown
        return {rule: int(count) for rule, count in counts if rule != "all"}

    def refused(self, *arguments: str) -> str:
        """What is said where no job may start."""
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
        """Replace text that a file has once."""
        file = self.folder / path
        text = file.read_text()
        assert text.count(old) == 1, f"{old!r} is {text.count(old)} times in {path}"
        file.write_text(text.replace(old, new))

    def add_row(self, *cells: str) -> None:
        with (self.folder / "config" / "surveys.tsv").open("a") as sheet:
            sheet.write("\t".join(cells) + "\n")


@pytest.fixture(scope="session")
def finished(tmp_path_factory, project_root) -> Project:
    """The workflow after its first run: two synthetic surveys to train on and a recorded one that
    is only classified. Not to be changed; take ``project`` for that."""
    folder = tmp_path_factory.mktemp("finished") / "project"
    folder.mkdir()
    for name in PARTS:
        source = project_root / name
        if source.is_dir() and not source.is_symlink():
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(source, folder / name, ignore=ignored)
        else:
            shutil.copy2(source, folder / name, follow_symlinks=False)
    project = Project(folder)
    project.configure(_tiny(yaml.safe_load((project_root / "config" / "test.yaml").read_text())))
    sheet = folder / "config" / "surveys.tsv"
    sheet.write_text("survey\tpath\tcodes\trole\n")
    for name in ("first", "second"):
        project.add_row(name, f"{{results_dir}}/synthetic/{name}.laz", "edp", "train")
    project.add_row("own", "data/own.laz", "edp", "new")
    _record(folder / "data" / "own.laz")
    return Project(folder, project.run())


def _tiny(test: dict[str, Any]) -> dict[str, Any]:
    """The configuration of minutes, without its new survey and with an inbox."""
    test["synthetic"]["surveys"] = test["synthetic"]["surveys"][:2]
    own = {"results_dir": "results", "surveys": "config/surveys.tsv", "dataset": "tiny"}
    return {**test, **own, "new_surveys": {"folder": "surveys", "codes": "edp"}}


def _record(path: Path) -> None:
    """A survey that the workflow did not make."""
    from scenenet.synthetic import SyntheticSettings, make_survey

    make_survey(SyntheticSettings(towers=2, seed=9, density=4), path)


@pytest.fixture
def project(finished, tmp_path) -> Project:
    """A copy of the finished project, dates included, to change and plan again."""
    folder = tmp_path / "project"
    subprocess.run(["cp", "-a", str(finished.folder), str(folder)], check=True)
    return Project(folder)
