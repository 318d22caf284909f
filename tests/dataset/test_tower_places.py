"""The ground under the axis of labelled and true towers, and their heights."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.dataset.tower_places import TowerPlaces
from scenenet.pointcloud import PointCloud, class_scheme, iter_chunks
from scenenet.synthetic import SyntheticSettings, make_survey

GROUND, GRASS, TOWER = 2, 3, 15


def cloud(xyz: np.ndarray, code: int = GROUND) -> PointCloud:
    codes = np.full(len(xyz), code, np.uint8)
    return PointCloud(np.asarray(xyz, float), codes, class_scheme("edp"))


def table(*towers: tuple[float, float, float]) -> pd.DataFrame:
    return pd.DataFrame(towers, columns=["x", "y", "top"], dtype=float)


def slope(x: float, y: float, side: float = 1.0) -> np.ndarray:
    """Ground of 20 x 20 m about (x, y) that rises by 0.5 m per metre to the east from z 100."""
    dx, dy = (axis.ravel() for axis in np.meshgrid(*[np.arange(-10, 10.5, 0.5)] * 2))
    kept = dx * side <= 0
    return np.column_stack([x + dx, y + dy, 100 + 0.5 * dx])[kept]


def test_the_ground_is_that_under_the_axis_also_on_a_slope():
    places = TowerPlaces(table((500_000.0, 4_630_000.0, 130.0)))
    for half in (slope(500_000, 4_630_000, 1), slope(500_000, 4_630_000, -1)):
        places.add(cloud(half))  # in two chunks
    [(x, y, base, height)] = places.places()
    assert (x, y) == (500_000.0, 4_630_000.0)
    assert (base, height) == (pytest.approx(100.0), pytest.approx(30.0))


def test_ground_on_one_side_is_extrapolated_to_the_axis():
    places = TowerPlaces(table((0.0, 0.0, 130.0)))
    places.add(cloud(slope(0, 0, 1)[slope(0, 0, 1)[:, 0] < -1]))
    # All of it is below 99.5 m; its mean is 99.1 m.
    assert places.places()[0, 2] == pytest.approx(100.0, abs=0.05)


def test_without_ground_under_it_a_tower_has_no_height():
    places = TowerPlaces(table((0.0, 0.0, 30.0), (200.0, 0.0, 30.0)))
    places.add(cloud(slope(200, 0)))
    places.add(cloud(slope(0, 0), GRASS))
    places.add(cloud(np.empty((0, 3))))
    found = places.places()
    assert np.isnan(found[0, 2:]).all() and not np.isnan(found[1]).any()


def test_a_survey_without_towers_has_no_places():
    assert TowerPlaces(table()).places().shape == (0, 4)


def test_bases_and_heights_are_those_of_the_synthetic_scene(tmp_path):
    files = [tmp_path / name for name in ("line.laz", "truth.laz", "towers.geojson")]
    make_survey(SyntheticSettings(towers=5, seed=3), files[0], truth=files[1], towers=files[2])
    towers = survey_towers(files[1], "edp", TowerSettings()).towers
    places = TowerPlaces(towers)
    for chunk in iter_chunks(files[1], "edp", chunk_points=100_000):
        places.add(chunk)
    scene = [f["properties"] for f in json.loads(files[2].read_text())["features"]]
    record = np.array([[tower[key] for key in ("x", "y", "base", "height")] for tower in scene])
    found = places.places()
    assert len(found) == len(record)
    nearest = np.argmin(np.hypot(*(found[:, None, :2] - record[:, :2]).T), axis=0)
    off = np.abs(found - record[nearest])
    # The lowest tower point is up to 1.1 m above the ground under the axis.
    assert np.median(off[:, 2:], axis=0) == pytest.approx([0, 0], abs=0.15)
    assert off.max() < 0.5
