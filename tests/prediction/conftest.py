"""A model that finds poles, for surveys of poles."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenenet.models.model_file import write_model


@pytest.fixture(scope="package")
def model(pole_finder, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("model") / "by-hand.json"
    write_model(path, *pole_finder)
    return path
