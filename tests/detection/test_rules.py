"""From detected voxels to towers: what is a tower and what is not, in scenes placed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenenet.detection.detected_voxels import DetectedVoxels
from scenenet.detection.find import find_towers
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.surroundings import surroundings_in

TAU = 0.5


@pytest.fixture(scope="module")
def pole(points, lattice):
    """A function that makes a pole with conductors to two sides: (its points, its voxels)."""

    def make(x=0.0, y=0.0, height=15, bearings=(80, 260)):
        body = points.column(x, y, 0, height)
        conductors = [points.conductors(b, height - 0.5, x=x, y=y, end=31) for b in bearings]
        return points.together(body, *conductors), lattice.column(x, y, 0, height)

    return make


def detect(detected, around, probability=0.9, **changes):
    """The towers among points ``around`` with the voxels ``detected``."""
    occupied = np.unique(np.floor(around), axis=0) + 0.5
    return find_towers(
        DetectedVoxels(
            detected, np.broadcast_to(np.asarray(probability, float), len(detected)), 1.0
        ),
        surroundings_in(occupied),
        surroundings_in(around),
        TAU,
        DetectionSettings(**changes),
    )


def own_voxels(tower, detected):
    """Rows of the voxels of a tower."""
    voxels = DetectedVoxels(detected, np.ones(len(detected)), 1.0)
    return voxels.within(tower.place, tower.reach).tolist()


def upper(body, by=5):
    """The part of a pole that a model detects: not its foot."""
    return body[np.argsort(body[:, 2])][by:]


def test_without_detected_voxels_there_is_no_tower(points):
    assert detect(np.empty((0, 3)), points.ground()) == []


def test_a_pole_with_conductors_is_a_tower_with_all_measurements(points, pole):
    around, body = pole(1, -1)
    [tower] = detect(upper(body), points.together(points.ground(), around))
    x, y, z = points.place
    assert (tower.x, tower.y) == pytest.approx((x + 1.5, y - 0.5), abs=0.1)
    assert tower.base == pytest.approx(z, abs=0.1)
    assert tower.height == pytest.approx(15.0, abs=0.2)
    assert tower.width < 0.5
    assert tower.upright == 1.0
    assert own_voxels(tower, upper(body)) == list(range(10))
    assert tower.probability == 0.9
    assert sorted(round(s.bearing) for s in tower.spans) == pytest.approx([80, 260], abs=3)


@pytest.mark.parametrize("bearings", [(), (80,), (80, 260), (80, 200)])
def test_a_pole_is_a_tower_only_with_conductors(points, pole, bearings):
    around, body = pole(bearings=bearings)
    found = detect(upper(body), points.together(points.ground(), around))
    assert [len(t.spans) for t in found] == ([len(bearings)] if bearings else [])
    lone = detect(upper(body), points.together(points.ground(), around), min_conductor=0)
    assert len(lone) == 1


def test_a_pole_at_the_edge_of_the_data_is_a_tower(points, pole):
    around, body = pole()
    everything = points.together(points.ground(), around)
    assert len(detect(upper(body), everything[everything[:, 0] >= points.place[0] - 2])) == 1


def test_a_tower_without_ground_or_most_of_its_conductors_is_found(points, pole):
    around, body = pole(height=30)
    near = np.hypot(*(around - points.place)[:, :2].T) < 15
    [tower] = detect(upper(body), around[near])
    assert tower.height == pytest.approx(30, abs=3)


def test_a_tree_detected_from_foot_to_top_is_not_a_tower(points, lattice):
    tree = points.tree(0, 0, 18)
    trunk = lattice.column(0, 0, 3, 18)
    wood = [points.tree(x, y, 17, seed=x + y + 30) for x in (-9, 0, 9) for y in (-9, 9)]
    assert detect(trunk, points.together(points.ground(), tree)) == []
    assert detect(trunk, points.together(points.ground(), tree, *wood)) == []


def test_conductors_above_one_another_are_not_a_tower(points, lattice):
    levels = [points.conductors(b, z, beside=(0.0,)) for b in (80, 260) for z in (18, 24, 30)]
    above = np.concatenate([lattice.column(0, 0, z, z + 1) for z in (17, 18, 23, 24, 29, 30)])
    assert detect(above, points.together(points.ground(), *levels)) == []


def test_a_wall_under_conductors_is_not_a_tower(points, lattice):
    side = np.arange(-9, 9, 0.5)
    block = points.block(side, side, np.arange(0, 15, 0.5))
    line = [points.conductors(b, 15) for b in (80, 260)]
    around = points.together(points.ground(), block, *line)
    assert detect(upper(lattice.column(0, 0, 0, 15)), around) == []


def test_a_low_post_is_not_a_tower(points, pole):
    around, body = pole(height=8)
    everything = points.together(points.ground(), around)
    assert detect(upper(body, 3), everything) == []
    assert len(detect(upper(body, 3), everything, min_height=7.0)) == 1


def test_a_few_detected_voxels_are_enough_and_two_are_not(points, pole):
    around, body = pole()
    everything = points.together(points.ground(), around)
    assert len(detect(upper(body, 12), everything)) == 1
    assert detect(upper(body, 13), everything) == []
    assert len(detect(upper(body, 13), everything, min_voxels=2, min_body=2.0)) == 1


def test_voxels_detected_at_one_height_are_not_a_tower(points, lattice, pole):
    around, _ = pole()
    head = lattice.voxels(np.array([[x, 0, 14.0] for x in range(-3, 4)]))
    assert detect(head, points.together(points.ground(), around)) == []


def test_detected_ends_of_a_crossarm_are_the_same_tower(points, lattice, pole):
    around, body = pole(height=40)
    arms = [points.column(s * 9, 0, 30, 36) for s in (-1, 1)]
    seen = [lattice.column(s * 9, 0, 30, 36) for s in (-1, 1)]
    everything = points.together(points.ground(), around, *arms)
    [tower] = detect(np.concatenate([upper(body, 20), *seen]), everything)
    assert abs(tower.x - points.place[0] - 0.5) < 0.2


def test_each_tower_of_a_line_is_detected_once(points, pole):
    parts = [pole(x, 0, bearings=(90, 270)) for x in (-60, 0, 60)]
    around = points.together(points.ground(90), *(a for a, _ in parts))
    detected = np.concatenate([upper(b) for _, b in parts])
    towers = detect(detected, around, np.repeat([0.5, 0.9, 0.7], 10))
    # highest probability first
    assert [round(t.x - points.place[0] - 0.5) for t in towers] == [0, 60, -60]
    assert [own_voxels(t, detected) for t in towers] == [
        list(range(10, 20)), list(range(20, 30)), list(range(10))
    ]  # fmt: skip


def test_a_tree_beside_a_tower_does_not_hide_it(points, lattice, pole):
    around, body = pole()
    everything = points.together(points.ground(), around, points.tree(4, -5, 11))
    detected = np.concatenate([upper(body), lattice.column(4, -5, 4, 9)])
    [tower] = detect(detected, everything)
    assert np.hypot(*(np.array([tower.x, tower.y]) - points.place[:2] - 0.5)) < 0.2


@pytest.mark.parametrize(("bearings", "n"), [((80,), 0), ((80, 260), 1)])
def test_below_tau_conductors_must_leave_in_two_directions(points, pole, bearings, n):
    around, body = pole(bearings=bearings)
    everything = points.together(points.ground(), around)
    assert len(detect(upper(body), everything, probability=0.4)) == n
    assert len(detect(upper(body), everything, probability=0.6)) == 1


def test_a_tree_under_a_line_is_not_a_tower(points, lattice):
    side = np.arange(-6, 6, 0.4)
    crown = points.block(side, side, np.arange(6, 15, 0.4))
    crown = crown[np.hypot(*(crown - points.place)[:, :2].T) < 6]
    line = [points.conductors(b, 17.0) for b in (80, 260)]
    trunk = points.column(0, 0, 0, 15)
    around = points.together(points.ground(), trunk, crown, *line)
    for probability in (0.4, 0.9):
        assert detect(upper(lattice.column(0, 0, 0, 17)), around, probability=probability) == []


def test_voxels_from_two_fifths_of_the_response_at_tau_are_candidates():
    settings = DetectionSettings()
    assert np.arctanh(settings.threshold(0.99)) == pytest.approx(np.arctanh(0.99) * 0.4)
    assert settings.threshold(0.0) == 0.0
    assert settings.threshold(1.0) == 1.0
    assert DetectionSettings(look=1.0).threshold(0.7) == pytest.approx(0.7)


@settings(max_examples=5)
@given(st.permutations(range(20)))
def test_order_of_voxels_does_not_matter(points, pole, order):
    parts = [pole(x, 0) for x in (0, 60)]
    around = points.together(points.ground(90), *(a for a, _ in parts))
    detected = np.concatenate([upper(b) for _, b in parts])
    probability = np.linspace(0.5, 0.9, 20)
    one = detect(detected, around, probability)
    other = detect(detected[order], around, probability[order])
    for a, b in zip(one, other, strict=True):
        assert (a.x, a.y, a.base, a.height) == pytest.approx((b.x, b.y, b.base, b.height))
        of_other = own_voxels(b, detected[order])
        assert set(own_voxels(a, detected)) == {order[v] for v in of_other}


@settings(max_examples=5)
@given(st.integers(-300_000, 300_000), st.integers(-300_000, 300_000))
def test_the_position_of_a_tower_does_not_matter(points, pole, east, north):
    around, body = pole()
    move = np.array([east, north, 0.0])
    everything = points.together(points.ground(), around)
    [here] = detect(upper(body), everything)
    [there] = detect(upper(body) + move, everything + move)
    assert (there.x - here.x, there.y - here.y) == pytest.approx(tuple(move[:2]), abs=0.02)
    assert there.height == pytest.approx(here.height, abs=0.05)
