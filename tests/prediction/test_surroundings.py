"""What is around a position is what a search through the whole survey finds."""

from __future__ import annotations

import numpy as np
import pytest
from fixtures.spools import spool_of

from scenenet.prediction import surroundings
from scenenet.prediction.surroundings import (
    Positions,
    SurveySurroundings,
    occupied_voxels,
    survey_points,
)
from scenenet.prediction.work.lattice import Lattice
from scenenet.prediction.work.tiling import TileSpool

ORIGIN = np.array([544_000.0, 4_634_000.0, 80.0])


XYZ = np.random.default_rng(0).uniform(-150, 150, (4000, 3)) + ORIGIN


@pytest.fixture(scope="module")
def spool(tmp_path_factory) -> TileSpool:
    return spool_of(tmp_path_factory.mktemp("tiles") / "work", 1.5, [XYZ])


@pytest.fixture(scope="module")
def everything(spool) -> np.ndarray:
    return np.concatenate([spool.centres(tile.zyx()) for tile in spool.tiles()])


@pytest.mark.parametrize("radius", [0.0, 3.0, 28.0, 75.0, 1000.0])
@pytest.mark.parametrize("away", [(0, 0), (-96, 96), (-149, 149), (170, 0), (900, -900)])
def test_it_equals_a_search_through_all_voxels(spool, everything, radius, away):
    place = ORIGIN[:2] + away
    found = occupied_voxels(spool)(place, radius)
    apart = np.hypot(*(everything[:, :2] - place).T)
    assert {tuple(v) for v in found} == {tuple(v) for v in everything[apart <= radius]}
    assert len(found) == (apart <= radius).sum()


@pytest.mark.parametrize("radius", [3.0, 28.0])
def test_points_are_those_of_the_survey(spool, radius):
    found = survey_points(spool)(ORIGIN[:2], radius)
    near = XYZ[np.hypot(*(XYZ[:, :2] - ORIGIN[:2]).T) <= radius]
    assert len(found) == len(near)
    np.testing.assert_allclose(
        found[np.lexsort(found.T)], near[np.lexsort(near.T)], rtol=0, atol=1e-5
    )


def test_positions_are_those_of_the_survey_to_the_last_bit(tmp_path):
    spool = spool_of(tmp_path / "work", 0.7, [XYZ])
    codes = [code for code, _ in spool.places()]
    for look_up, expected in (
        (survey_points(spool), [spool.points(code) for code in codes]),
        (occupied_voxels(spool), [spool.centres(spool.tile(code).zyx()) for code in codes]),
    ):
        found, every = look_up(ORIGIN[:2], 1000.0), np.concatenate(expected)
        np.testing.assert_array_equal(found[np.lexsort(found.T)], every[np.lexsort(every.T)])


def test_small_tiles_are_read_once(spool):
    reads = []

    def read(code):
        reads.append(code)
        return Positions.of_points(spool, code)

    near = SurveySurroundings(spool, read, kept=2)
    for _ in range(2):
        near(ORIGIN[:2], 1000.0)
    assert sorted(reads) == [code for code, _ in spool.places()]


def test_large_tiles_do_not_all_stay_in_memory(spool, monkeypatch):
    monkeypatch.setattr(surroundings, "KEPT_IN_ALL", 0)
    reads = []

    def read(code):
        reads.append(code)
        return Positions.of_points(spool, code)

    near = SurveySurroundings(spool, read, kept=2)
    near(ORIGIN[:2], 1000.0)
    assert len(near._tiles) == 2
    near(ORIGIN[:2], 1000.0)
    assert len(reads) == 2 * len(spool)


def test_a_survey_without_points_has_none(tmp_path):
    assert occupied_voxels(TileSpool(Lattice(1.0), []))(np.zeros(2), 100.0).shape == (0, 3)
