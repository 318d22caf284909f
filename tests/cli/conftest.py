"""A survey and a model that take no time."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenenet.models.model_file import write_model
from scenenet.pointcloud import write_las


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
