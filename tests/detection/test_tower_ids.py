"""The id of a tower follows from its place, whatever else the survey has."""

from __future__ import annotations

import hypothesis
import hypothesis.strategies as st
import numpy as np
import pytest

from scenenet.detection.tower_ids import tower_ids

LARGEST = np.iinfo(np.uint32).max
POLE = (500_020.5, 4_630_031.5)

coordinate = st.floats(-1e7, 1e7, allow_nan=False)
places = st.lists(st.tuples(coordinate, coordinate), max_size=30).map(
    lambda rows: np.array(rows, float).reshape(-1, 2)
)


def test_the_digits_are_the_place_in_steps_of_10_m():
    assert tower_ids(np.array([POLE])) == [1000263003]
    assert tower_ids(np.array([(139_870.0, 523_413.0)])) == [1398752341]
    assert tower_ids(np.empty((0, 2))) == []


def test_no_tower_has_the_id_of_none():
    assert tower_ids(np.array([(4.0, 4.0)])) == [1]
    assert tower_ids(np.array([(4.0, 4.0), (4.0, 14.0)])) == [2, 1]


@hypothesis.given(places)
def test_ids_are_unique_and_fit_into_the_dimension(places):
    ids = tower_ids(places)
    assert len(ids) == len(set(ids)) == len(places)
    assert all(0 < each <= LARGEST for each in ids)


@hypothesis.given(places, st.randoms(use_true_random=False))
def test_the_order_of_the_list_does_not_count(places, random):
    rows = list(range(len(places)))
    random.shuffle(rows)
    ids = dict(zip(map(tuple, places.tolist()), tower_ids(places), strict=True))
    hypothesis.assume(len(ids) == len(places))
    again = tower_ids(places[rows])
    assert [ids[tuple(place)] for place in places[rows].tolist()] == again


@pytest.mark.parametrize("offset", [(0.0, 2000.0), (1500.0, -700.0), (-3e4, 5e4)])
def test_towers_elsewhere_change_no_id(offset):
    draw = np.random.default_rng(3)
    line = np.array(POLE) + np.column_stack([np.arange(0, 1500, 60), draw.normal(0, 3, 25)])
    beside = line + np.array(
        [3.0, 4.0]
    )  # a second line so close that many towers share their cells
    here = np.concatenate([line, beside])
    alone = tower_ids(here)
    both = tower_ids(np.concatenate([here + offset, here]))
    assert both[50:] == alone


def test_a_millimetre_changes_no_id_of_towers_at_round_coordinates():
    draw = np.random.default_rng(0)
    planned = np.array(POLE) // 10 * 10 + draw.integers(0, 200, (100, 2)) * 5.0
    planned = np.unique(planned, axis=0)
    moved = planned + draw.uniform(-0.001, 0.001, planned.shape)
    ids = tower_ids(planned)
    portals = np.concatenate([planned, planned + np.array([0.0, 4.0])])
    assert tower_ids(moved) == ids
    again = portals + draw.uniform(-0.001, 0.001, portals.shape)
    assert tower_ids(again) == tower_ids(portals)


def test_of_two_towers_in_a_cell_the_second_gets_the_next_free_number():
    south, north, beyond = POLE, (POLE[0] + 1.0, POLE[1] + 3.0), (POLE[0], POLE[1] + 9.0)
    first, second, third = tower_ids(np.array([south, north, beyond]))
    assert third == first + 1  # its own cell
    assert second == first + 2


def test_a_place_that_is_not_finite_is_an_error():
    with pytest.raises(ValueError, match="finite"):
        tower_ids(np.array([(np.nan, 0.0)]))
