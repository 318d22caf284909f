"""Real surveys of many programs, sensors and countries: an answer or an error, and soon."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
import pytest
from trust.real_files import LARGE, LIMIT_S, differences, look_at, real_files

from scenenet.models.model_file import write_model
from scenenet.pointcloud import PointCloud, add_dimensions, write_las


@pytest.fixture(scope="module")
def model(pole_finder, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("model") / "by-hand.json"
    write_model(path, *pole_finder)
    return path


@pytest.mark.trust
@pytest.mark.parametrize("file", real_files() or [None], ids=lambda file: file and file.name)
def test_a_real_file_ends_in_an_answer_or_an_error_and_loses_nothing(file, model):
    if file is None:
        pytest.skip("no real recordings here: set SCENENET_REAL_DATA to a folder that has them")
    for outcome in look_at([file], model):
        assert outcome.faults == (), outcome
        if outcome.n_points < LARGE:
            assert min(outcome.seconds, outcome.cpu_seconds) < LIMIT_S, outcome


def test_what_a_prediction_loses_is_noticed(tmp_path):
    """The comparison itself: a file without a dimension, with another order, or with one less."""
    xyz = np.random.default_rng(0).uniform(0, 50, (100, 3))
    source, target = tmp_path / "in.laz", tmp_path / "out.laz"
    write_las(source, PointCloud(xyz, np.arange(100, dtype=np.uint8)), extra={"height": xyz[:, 2]})
    names = {"tower_probability": "f4", "tower_id": "u4"}
    add_dimensions(source, target, names, lambda xyz: {
        "tower_probability": xyz[:, 0], "tower_id": np.zeros(len(xyz), int)
    })  # fmt: skip
    assert differences(source, target) == []
    las = laspy.read(target)
    las.points.array[:] = las.points.array[::-1].copy()
    las.write(target)
    assert {"dimension X", "dimension height"} <= set(differences(source, target))
    las.points = las.points[:50]
    las.write(target)
    assert differences(source, target) == ["100 points became 50"]
    las = laspy.read(source)
    las.remove_extra_dim("height")
    las.write(target)
    assert {"tower_id", "dimension height"} <= set(differences(source, target))
