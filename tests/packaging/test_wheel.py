"""The package is built, installed in a fresh environment without extras, and used."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pytest

pytestmark = pytest.mark.packaging

LIMIT_S = 600
ENDINGS = ("laz", "gpkg", "towers.csv", "towers.geojson", "summary.json", "html")
"""Of the files of a prediction."""
NOT_IN_THE_CORE = ("matplotlib", "mlflow", "snakemake")
"""Distributions that only extras bring; jinja2 and pygments come with torch and rich."""

ONLY_IN_THE_CHECKOUT = (".ci/run", ".gitignore")


@dataclass(frozen=True)
class Built:
    """The two files of a release."""

    wheel: Path
    sdist: Path


@dataclass(frozen=True)
class Installed:
    """A fresh environment with the wheel and its dependencies, and a folder to work in."""

    bin: Path
    folder: Path

    def call(self, *command: str, code: int = 0) -> subprocess.CompletedProcess[str]:
        done = _run([str(self.bin / command[0]), *command[1:]], self.folder)
        assert done.returncode == code, done.stderr
        return done

    def scenenet(self, *arguments: str, code: int = 0) -> subprocess.CompletedProcess[str]:
        return self.call("scenenet", *arguments, code=code)


def _run(command: list[str], folder: Path, **changes: str) -> subprocess.CompletedProcess[str]:
    """Run a command that sees neither this checkout nor this environment."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL"))}
    return subprocess.run(
        command,
        cwd=folder,
        env=environment | changes,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )


def _tracked(root: Path, *folders: str) -> set[str]:
    """The files that git knows, relative to ``root``."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", *folders], cwd=root, capture_output=True, text=True, check=True
    )
    return set(listed.stdout.split("\0")) - {""}


@pytest.fixture(scope="module")
def built(project_root: Path, tmp_path_factory) -> Built:
    """The sdist, and the wheel that is built from the sdist."""
    out = tmp_path_factory.mktemp("dist")
    done = _run([sys.executable, "-m", "build", "--outdir", str(out), str(project_root)], out)
    assert done.returncode == 0, done.stdout + done.stderr
    return Built(next(out.glob("*.whl")), next(out.glob("*.tar.gz")))


@pytest.fixture(scope="module")
def installed(built: Built, project_root: Path, tmp_path_factory) -> Installed:
    folder = tmp_path_factory.mktemp("fresh")
    made = _run([sys.executable, "-m", "venv", str(folder / "venv")], folder)
    assert made.returncode == 0, made.stderr
    pip = [str(folder / "venv" / "bin" / "python"), "-m", "pip", "install", "--quiet"]
    # Compiling every module of torch takes half of the time; without it only imported ones are.
    pip += ["--disable-pip-version-check", "--no-compile"]
    done = _run([*pip, "-c", str(project_root / "constraints.txt"), str(built.wheel)], folder)
    assert done.returncode == 0, done.stderr
    return Installed(folder / "venv" / "bin", folder)


@pytest.fixture(scope="module")
def predicted(installed: Installed) -> Path:
    """A synthetic survey, a model trained on it and its prediction, by the installed package."""
    installed.scenenet("synth", "line.laz", "--towers", "4", "--seed", "3")
    training = "--protocol thesis --epochs 2 --seeds 1 --resolution 32 --validation 0"
    installed.scenenet(
        "train", "line.laz", "--codes", "edp", "--out", "model.json", *training.split()
    )
    installed.scenenet("predict", "line.laz", "--model", "model.json", "--out", "found")
    return installed.folder / "found"


def test_the_wheel_has_every_file_of_the_package(built: Built, project_root: Path):
    with zipfile.ZipFile(built.wheel) as wheel:
        packed = set(wheel.namelist())
    assert not _tracked(project_root, "scenenet") - packed
    assert not [name for name in packed if name.startswith(("tests", "workflow"))]


def test_no_extra_is_installed(installed: Installed):
    listed = installed.call("python", "-m", "pip", "list", "--format", "json").stdout
    assert not {row["name"].lower() for row in json.loads(listed)} & set(NOT_IN_THE_CORE)


def test_the_package_is_typed_and_comes_from_the_wheel(installed: Installed):
    where = "import scenenet, pathlib; print(pathlib.Path(scenenet.__file__).parent)"
    folder = Path(installed.call("python", "-c", where).stdout.strip())
    assert installed.bin.parent in folder.parents
    assert (folder / "py.typed").is_file()


def test_version_prints_the_version(installed: Installed, project_root: Path):
    project = tomllib.loads((project_root / "pyproject.toml").read_text())["project"]
    assert installed.scenenet("--version").stdout == f"scenenet {project['version']}\n"


def test_a_survey_is_predicted_and_checked(installed: Installed, predicted: Path):
    found = {path.name for path in predicted.iterdir()}
    assert found == {f"line.{ending}" for ending in ENDINGS}
    summary = json.loads((predicted / "line.summary.json").read_text())
    checked = installed.scenenet("check", "found/line.laz", "--codes", "edp", "--json")
    report = json.loads(checked.stdout)[0]
    assert report["n_points"] == summary["points"] > 10_000
    assert "tower_probability" in report["extra_dimensions"]


def test_the_model_of_the_package_finds_the_towers(installed: Installed, predicted: Path):
    installed.scenenet("predict", "line.laz", "--out", "packaged")
    towers = json.loads((installed.folder / "packaged" / "line.towers.geojson").read_text())
    assert len(towers["features"]) == 4


def test_a_model_is_scored(installed: Installed, predicted: Path):
    command = "evaluate line.laz --model model.json --codes edp --resolution 32 --json"
    scores = json.loads(installed.scenenet(*command.split()).stdout)
    assert len(scores["per_sample"]) == scores["voxel"]["n_samples"] > 0
    assert 0 <= scores["voxel"]["f05"] <= 1


def test_a_command_that_needs_an_extra_says_which(installed: Installed, predicted: Path):
    command = "explain line.laz --model model.json --out why.html"
    done = installed.scenenet(*command.split(), code=1)
    assert "pip install 'scenenet[report]'" in done.stderr
    assert "Traceback" not in done.stderr


def test_commands_are_completed_in_a_shell(installed: Installed):
    done = _run(
        [str(installed.bin / "scenenet")],
        installed.folder,
        _SCENENET_COMPLETE="complete_bash",
        COMP_WORDS="scenenet pre",
        COMP_CWORD="1",
    )
    assert done.stdout.split() == ["predict"]


@pytest.fixture(scope="module")
def unpacked(built: Built, tmp_path_factory) -> Path:
    """The root of the source distribution."""
    folder = tmp_path_factory.mktemp("sdist")
    with tarfile.open(built.sdist) as archive:
        archive.extractall(folder, filter="data")
    return next(folder.iterdir())


def test_the_source_distribution_has_every_file_that_a_test_may_read(unpacked, project_root):
    for name in _tracked(project_root) - set(ONLY_IN_THE_CHECKOUT):
        if (project_root / name).is_file():  # and no link to a folder
            assert (unpacked / name).read_bytes() == (project_root / name).read_bytes(), name


def test_the_source_distribution_can_be_tested(unpacked):
    """Every file of tests is collected; only some are run, because the files are those of the
    checkout, where all are."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    done = _run([*command, "-k", "test_environment.py or test_provenance.py"], unpacked)
    assert done.returncode == 0, done.stdout
    assert re.search(r"^\d+ passed", done.stdout, re.MULTILINE)
