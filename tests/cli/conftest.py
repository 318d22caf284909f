"""The command line called in this process, with a survey and a model that take no time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from scenenet.cli.app import main
from scenenet.models.model_file import write_model
from scenenet.pointcloud import write_las


@dataclass(frozen=True)
class Called:
    """How a command ended."""

    code: int
    out: str
    err: str


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Callable[..., Called]:
    def run(*arguments: object) -> Called:
        capsys.readouterr()
        code = 0
        try:
            main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = int(end.code or 0)
        return Called(code, *capsys.readouterr())

    return run


@pytest.fixture
def pole_survey(scene, tmp_path) -> Path:
    """A pole on 50 x 50 m of flat ground."""
    path = tmp_path / "field.laz"
    write_las(path, scene([(25.5, 25.5)], size=(50.0, 50.0)))
    return path


@pytest.fixture
def pole_model(pole_finder, tmp_path) -> Path:
    path = tmp_path / "by-hand.json"
    write_model(path, *pole_finder)
    return path
