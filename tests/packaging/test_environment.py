"""The three lists of versions agree, and the extras divide the dependencies as documented."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import yaml


def _name(requirement: str) -> str:
    return re.sub(r"[-_.]+", "-", re.match(r"[A-Za-z0-9._-]+", requirement)[0]).lower()


def _pins(lines: list[str]) -> dict[str, str]:
    pinned = [line.strip() for line in lines if "==" in line and not line.startswith("#")]
    return {_name(line): line.split("==")[1] for line in pinned}


def _requirements(project: dict, extra: str) -> list[str]:
    """What an extra installs, the extras it includes resolved."""
    found = []
    for requirement in project["optional-dependencies"][extra]:
        included = re.fullmatch(r"scenenet\[([\w,]+)\]", requirement)
        if included:
            found += [r for name in included[1].split(",") for r in _requirements(project, name)]
        else:
            found.append(requirement)
    return found


@pytest.fixture(scope="module")
def project(project_root: Path) -> dict:
    return tomllib.loads((project_root / "pyproject.toml").read_text())["project"]


@pytest.fixture(scope="module")
def constraints(project_root: Path) -> dict[str, str]:
    return _pins((project_root / "constraints.txt").read_text().splitlines())


@pytest.fixture(scope="module")
def direct(project: dict) -> list[str]:
    return project["dependencies"] + _requirements(project, "dev")


def test_every_direct_dependency_has_a_tested_version(project, direct, constraints):
    missing = [r for r in direct + _requirements(project, "slurm") if _name(r) not in constraints]
    assert missing == []


def test_the_conda_environment_has_the_same_versions(project_root, direct, constraints):
    environment = yaml.safe_load((project_root / "environment.yaml").read_text())
    pip = next(entry["pip"] for entry in environment["dependencies"] if isinstance(entry, dict))
    assert _pins(pip) == {_name(r): constraints[_name(r)] for r in direct}


def test_the_package_metadata_locks_no_version(direct):
    # mkdocs 2 does not support the plugins of the site, so this bound is needed.
    locked = [r for r in direct if "==" in r or ("<" in r and _name(r) != "mkdocs")]
    assert locked == []


def test_torch_is_pinned_without_a_build(constraints):
    assert constraints["torch"] == "2.13.0"


def test_the_constraints_contain_no_machine_paths(project_root):
    text = (project_root / "constraints.txt").read_text()
    assert "file:" not in text and " @ " not in text


def test_the_core_needs_neither_workflow_nor_tracking_nor_report(project):
    core = {_name(requirement) for requirement in project["dependencies"]}
    assert not core & {_name(r) for r in _requirements(project, "workflow")}


def test_dev_includes_every_extra_but_slurm(project):
    dev = set(_requirements(project, "dev"))
    for extra in project["optional-dependencies"].keys() - {"dev", "slurm"}:
        assert set(_requirements(project, extra)) <= dev, extra
