"""The occupied voxels around a position are those of a search through all voxels."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.prediction.occupied_voxels import OccupiedVoxels
from scenenet.prediction.tiling import TileSpool

ORIGIN = np.array([544_000.0, 4_634_000.0, 80.0])


@pytest.fixture(scope="module")
def spool(tmp_path_factory) -> TileSpool:
    xyz = np.random.default_rng(0).uniform(-150, 150, (4000, 3)) + ORIGIN
    spool = TileSpool(tmp_path_factory.mktemp("tiles"), 1.5)
    spool.add(xyz)
    return spool


@pytest.fixture(scope="module")
def everything(spool) -> np.ndarray:
    return np.concatenate([spool.centres(tile.zyx()) for tile in spool.tiles()])


@pytest.mark.parametrize("radius", [0.0, 3.0, 28.0, 75.0, 1000.0])
@pytest.mark.parametrize("away", [(0, 0), (-96, 96), (-149, 149), (170, 0), (900, -900)])
def test_it_equals_a_search_through_all_voxels(spool, everything, radius, away):
    place = ORIGIN[:2] + away
    found = OccupiedVoxels(spool)(place, radius)
    apart = np.hypot(*(everything[:, :2] - place).T)
    assert {tuple(v) for v in found} == {tuple(v) for v in everything[apart <= radius]}
    assert len(found) == (apart <= radius).sum()


def test_a_survey_without_points_has_none(tmp_path):
    assert OccupiedVoxels(TileSpool(tmp_path, 1.0))(np.zeros(2), 100.0).shape == (0, 3)
