"""A line of poles that was predicted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest
from fixtures.review_files import rows_of
from fixtures.scenes import PLACE

from scenenet.cli.app import main
from scenenet.models.model_file import write_model
from scenenet.pointcloud import PointCloud, write_las

UNIT = 32629
POLES = [(20.5 + 30 * i, 20.5) for i in range(12)]
"""Places of the poles of the line, relative to ``fixtures.scenes.PLACE``."""
LOW_POLE, LOW_M = (95.5, 33.5), 8.0
"""Place of a pole that is too low to be found, and its height, m."""


@pytest.fixture(scope="package")
def found(scene, pole_finder, tmp_path_factory) -> Path:
    """The folder with the prediction of poles in a line and a low one beside it, not labelled."""
    line = scene(POLES, size=(370.0, 41.0), tree=(35.0, 8.0))
    z = np.arange(0.05, LOW_M, 0.05)
    around = np.random.default_rng(1).uniform(-0.2, 0.2, (len(z), 2))
    pole = np.column_stack([around + LOW_POLE, z]) + PLACE
    cloud = PointCloud(
        np.concatenate([line.xyz, pole]), np.append(line.classification, np.ones(len(z), np.uint8))
    )
    folder = tmp_path_factory.mktemp("line")
    survey, model, out = folder / "line.laz", folder / "by-hand.json", folder / "found"
    codes = np.where(cloud.classification == 15, 1, cloud.classification).astype(np.uint8)
    write_las(survey, PointCloud(cloud.xyz, codes, crs=pyproj.CRS(UNIT)))
    write_model(model, *pole_finder)
    main_ends_well("predict", survey, "--model", model, "--out", out, "--min-conductor", 0)
    return out


def main_ends_well(*arguments: object) -> None:
    """Run a command that must not fail."""
    main_arguments = [str(argument) for argument in arguments]
    try:
        main(main_arguments)
    except SystemExit as end:
        assert not end.code, main_arguments


@pytest.fixture
def towers(found) -> list[dict[str, str]]:
    """The rows of the tower list, west to east."""
    rows = rows_of(found / "line.towers.csv")
    assert len(rows) == len(POLES)
    return sorted(rows, key=lambda row: float(row["x"]))


@pytest.fixture
def pole_model(pole_finder, tmp_path) -> Path:
    path = tmp_path / "by-hand.json"
    write_model(path, *pole_finder)
    return path
