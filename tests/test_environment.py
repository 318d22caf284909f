"""The three places that name versions agree, and the packages promise what the design says."""

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


@pytest.fixture(scope="module")
def project(project_root: Path) -> dict:
    return tomllib.loads((project_root / "pyproject.toml").read_text())["project"]


@pytest.fixture(scope="module")
def constraints(project_root: Path) -> dict[str, str]:
    return _pins((project_root / "constraints.txt").read_text().splitlines())


@pytest.fixture(scope="module")
def direct(project: dict) -> list[str]:
    return project["dependencies"] + project["optional-dependencies"]["dev"]


def test_every_direct_dependency_has_a_tested_version(direct, constraints):
    missing = [r for r in direct if _name(r) not in constraints]
    assert missing == []


def test_the_conda_environment_has_the_same_versions(project_root, direct, constraints):
    environment = yaml.safe_load((project_root / "environment.yaml").read_text())
    pip = next(entry["pip"] for entry in environment["dependencies"] if isinstance(entry, dict))
    assert _pins(pip) == {_name(r): constraints[_name(r)] for r in direct}


def test_the_package_metadata_locks_no_version(direct):
    locked = [r for r in direct if "==" in r or "<" in r]
    assert locked == []


def test_torch_is_pinned_without_a_build(constraints):
    assert constraints["torch"] == "2.13.0"


def test_the_constraints_name_no_place_on_a_machine(project_root):
    text = (project_root / "constraints.txt").read_text()
    assert "file:" not in text and " @ " not in text
