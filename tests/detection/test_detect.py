"""From detected voxels to towers, with voxels placed by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenenet.detection.detect import body_voxels, detect_towers, surroundings_in
from scenenet.detection.settings import DetectionSettings

TAU = 0.5


@pytest.fixture(scope="module")
def pole(lattice):
    """A function that makes a pole with conductors to two sides: (all its voxels, its body)."""

    def make(x=0.0, y=0.0, height=15, bearings=(80, 260)):
        body = lattice.column(x, y, 0, height)
        conductors = [lattice.conductors(b, height - 0.5, x=x + 0.5, y=y + 0.5) for b in bearings]
        return lattice.together(body, *conductors), body

    return make


def detect(detected, around, probability=0.9, **changes):
    given_probability = np.broadcast_to(np.asarray(probability, float), len(detected))
    return detect_towers(
        detected, given_probability, surroundings_in(around), 1.0, TAU, DetectionSettings(**changes)
    )


def upper(body, by=5):
    """The part of a pole that a model detects: not its foot."""
    return body[np.argsort(body[:, 2])][by:]


def test_without_detected_voxels_there_is_no_tower(lattice):
    assert detect(np.empty((0, 3)), lattice.ground()) == []


def test_a_pole_with_conductors_is_a_tower_with_all_measurements(lattice, pole):
    around, body = pole(3, -2)
    [tower] = detect(upper(body), lattice.together(lattice.ground(), around))
    x, y, _ = lattice.place
    assert (tower.x, tower.y) == pytest.approx((x + 3.5, y - 1.5), abs=0.1)
    assert tower.base == pytest.approx(lattice.place[2])
    assert tower.height == pytest.approx(15.0)
    assert tower.width == pytest.approx(1.0)
    assert tower.upright == 1.0
    assert tower.voxels.tolist() == list(range(10))
    assert tower.probability == 0.9
    assert sorted(round(s.bearing) for s in tower.spans) == pytest.approx([80, 260], abs=3)


@pytest.mark.parametrize("bearings", [(), (80,), (80, 260), (80, 200)])
def test_a_pole_is_a_tower_only_with_conductors(lattice, pole, bearings):
    around, body = pole(bearings=bearings)
    found = detect(upper(body), lattice.together(lattice.ground(), around))
    assert [len(t.spans) for t in found] == ([len(bearings)] if bearings else [])
    lone = detect(upper(body), lattice.together(lattice.ground(), around), min_conductor=0)
    assert len(lone) == 1


def test_a_pole_at_the_edge_of_the_data_is_a_tower(lattice, pole):
    around, body = pole()
    everything = lattice.together(lattice.ground(), around)
    assert len(detect(upper(body), everything[everything[:, 0] >= lattice.place[0] - 2])) == 1


def test_a_tower_without_ground_or_most_of_its_conductors_is_found(lattice, pole):
    around, body = pole(height=30)
    near = np.hypot(*(around - lattice.place)[:, :2].T) < 15
    [tower] = detect(upper(body), around[near])
    assert tower.height == pytest.approx(30, abs=3)


def test_a_tree_detected_from_foot_to_top_is_not_a_tower(lattice):
    tree = lattice.tree(0, 0, 18)
    trunk = lattice.column(0, 0, 3, 18)
    wood = [lattice.tree(x, y, 17, seed=x + y + 30) for x in (-9, 0, 9) for y in (-9, 9)]
    assert detect(trunk, lattice.together(lattice.ground(), tree)) == []
    assert detect(trunk, lattice.together(lattice.ground(), tree, *wood)) == []


def test_conductors_above_one_another_are_not_a_tower(lattice):
    levels = [lattice.conductors(b, z, beside=(0.0,)) for b in (80, 260) for z in (18, 24, 30)]
    above = np.concatenate([lattice.column(0, 0, z, z + 1) for z in (17, 18, 23, 24, 29, 30)])
    around = lattice.together(lattice.ground(), above, *levels)
    assert detect(above, around) == []
    assert len(detect(above, around, min_upright=0.0)) == 1


def test_a_wall_under_conductors_is_not_a_tower(lattice):
    x, y, z = (v.ravel() for v in np.meshgrid(np.arange(-9, 10), np.arange(-9, 10), np.arange(15)))
    block = lattice.voxels(np.column_stack([x, y, z]))
    line = [lattice.conductors(b, 15) for b in (80, 260)]
    assert detect(upper(lattice.column(0, 0, 0, 15)), lattice.together(block, *line)) == []


def test_a_low_post_is_not_a_tower(lattice, pole):
    around, body = pole(height=8)
    everything = lattice.together(lattice.ground(), around)
    assert detect(upper(body, 3), everything) == []
    assert len(detect(upper(body, 3), everything, min_height=7.0)) == 1


def test_a_few_detected_voxels_are_enough_and_two_are_not(lattice, pole):
    around, body = pole()
    everything = lattice.together(lattice.ground(), around)
    assert len(detect(upper(body, 12), everything)) == 1
    assert detect(upper(body, 13), everything) == []
    assert len(detect(upper(body, 13), everything, min_voxels=2, min_body=2.0)) == 1


def test_voxels_detected_at_one_height_are_not_a_tower(lattice, pole):
    around, _ = pole()
    head = lattice.voxels(np.array([[x, 0, 14.0] for x in range(-3, 4)]))
    assert detect(head, lattice.together(lattice.ground(), around, head)) == []


def test_detected_ends_of_a_crossarm_are_the_same_tower(lattice, pole):
    around, body = pole(height=40)
    arm = np.concatenate([lattice.column(s * 9, 0, 30, 36) for s in (-1, 1)])
    everything = lattice.together(lattice.ground(), around, arm)
    [tower] = detect(np.concatenate([upper(body, 20), arm]), everything)
    assert abs(tower.x - lattice.place[0] - 0.5) < 0.6
    assert len(tower.voxels) == 20 + len(arm)


def test_each_tower_of_a_line_is_detected_once(lattice, pole):
    parts = [pole(x, 0) for x in (-60, 0, 60)]
    around = lattice.together(lattice.ground(90), *(a for a, _ in parts))
    detected = np.concatenate([upper(b) for _, b in parts])
    towers = detect(detected, around, np.repeat([0.5, 0.9, 0.7], 10))
    assert [round(t.x - lattice.place[0] - 0.5) for t in towers] == [
        0,
        60,
        -60,
    ]  # highest probability first
    assert [t.voxels.tolist() for t in towers] == [
        list(range(10, 20)), list(range(20, 30)), list(range(10))
    ]  # fmt: skip


def test_a_tree_beside_a_tower_does_not_hide_it(lattice, pole):
    around, body = pole()
    everything = lattice.together(lattice.ground(), around, lattice.tree(4, -5, 11))
    detected = np.concatenate([upper(body), lattice.column(4, -5, 4, 9)])
    [tower] = detect(detected, everything)
    assert np.hypot(*(np.array([tower.x, tower.y]) - lattice.place[:2] - 0.5)) < 1.0


@pytest.mark.parametrize(("bearings", "n"), [((80,), 0), ((80, 260), 1)])
def test_below_tau_conductors_must_leave_in_two_directions(lattice, pole, bearings, n):
    around, body = pole(bearings=bearings)
    everything = lattice.together(lattice.ground(), around)
    assert len(detect(upper(body), everything, probability=0.4)) == n
    assert len(detect(upper(body), everything, probability=0.6)) == 1


def test_below_tau_a_tree_under_a_line_is_not_a_tower(lattice):
    x, y, z = (v.ravel() for v in np.meshgrid(np.arange(-6, 7), np.arange(-6, 7), np.arange(6, 15)))
    crown = lattice.voxels(np.column_stack([x, y, z])[np.hypot(x, y) < 6])
    line = [lattice.conductors(b, 17.0) for b in (80, 260)]
    trunk = lattice.column(0, 0, 0, 17)
    around = lattice.together(lattice.ground(), trunk, crown, *line)
    assert detect(upper(trunk), around, probability=0.4) == []
    assert len(detect(upper(trunk), around, probability=0.4, min_free=0.1)) == 1


def test_voxels_from_half_the_response_at_tau_are_candidates():
    settings = DetectionSettings()
    assert np.arctanh(settings.threshold(0.99)) == pytest.approx(np.arctanh(0.99) / 2)
    assert settings.threshold(0.0) == 0.0
    assert settings.threshold(1.0) == 1.0
    assert DetectionSettings(look=1.0).threshold(0.7) == pytest.approx(0.7)


@settings(max_examples=20)
@given(st.permutations(range(20)))
def test_order_of_voxels_does_not_matter(lattice, pole, order):
    parts = [pole(x, 0) for x in (0, 60)]
    around = lattice.together(lattice.ground(90), *(a for a, _ in parts))
    detected = np.concatenate([upper(b) for _, b in parts])
    probability = np.linspace(0.5, 0.9, 20)
    one = detect(detected, around, probability)
    other = detect(detected[order], around, probability[order])
    for a, b in zip(one, other, strict=True):
        assert (a.x, a.y, a.base, a.height) == pytest.approx((b.x, b.y, b.base, b.height))
        assert set(a.voxels.tolist()) == {order[v] for v in b.voxels}


@settings(max_examples=10)
@given(st.floats(-3e5, 3e5), st.floats(-3e5, 3e5))
def test_the_position_of_a_tower_does_not_matter(lattice, pole, east, north):
    around, body = pole()
    move = np.round([east, north, 0])
    [here] = detect(upper(body), lattice.together(lattice.ground(), around))
    [there] = detect(upper(body) + move, lattice.together(lattice.ground(), around) + move)
    assert (there.x - here.x, there.y - here.y) == pytest.approx(tuple(move[:2]), abs=1e-6)
    assert there.height == pytest.approx(here.height)


def test_a_body_belongs_to_the_tower_from_above_its_foot_to_its_top(lattice, pole):
    around, body = pole()
    beside = lattice.column(1, 0, 3, 6)
    apart = lattice.column(4, 0, 0, 8)
    everything = lattice.together(lattice.ground(), around, beside, apart)
    [tower] = detect(upper(body), everything)
    mine = {
        tuple(place) for place in everything[body_voxels(tower, everything, DetectionSettings())]
    }
    assert {tuple(p) for p in np.concatenate([body, beside])} >= {
        p for p in mine if abs(p[0] - tower.x) < 0.1 and abs(p[1] - tower.y) < 0.1
    }
    level = {round(p[2] - tower.base, 1) for p in mine}
    assert min(level) == 1.5  # the voxel on the ground is left out
    assert max(level) == 14.5
    assert {tuple(p) for p in beside} <= mine
    assert not {tuple(p) for p in apart} & mine


@pytest.mark.parametrize(("width", "reach"), [(1.0, 2.1), (2.0, 2.1), (6.0, 4.0)])
def test_the_body_of_a_wide_tower_reaches_further(lattice, pole, width, reach):
    around, body = pole()
    [tower] = detect(upper(body), lattice.together(lattice.ground(), around))
    tower = replace(tower, width=width)
    x = np.arange(0, 8, 0.05)
    ring = np.column_stack([tower.x + x, np.full(len(x), tower.y), np.full(len(x), tower.base + 9)])
    mine = body_voxels(tower, ring, DetectionSettings())
    assert x[mine].max() == pytest.approx(reach, abs=0.06)
    assert mine[x < reach - 0.01].all()


def test_of_two_axes_of_a_tower_the_free_standing_one_is_kept(lattice, pole):
    """The other axis is taller, but a neighbouring tree touches it at all levels."""
    from scenenet.detection import detect as detection

    around, body = pole()
    [right] = detect(upper(body), lattice.together(lattice.ground(), around))
    wrong = replace(right, x=right.x + 3, height=right.height + 1, free=0.7)
    detected = detection.DetectedVoxels(upper(body), np.full(10, 0.9), 1.0)
    [kept] = detection._without_duplicates([wrong, right], detected, DetectionSettings())
    assert (kept.x, kept.height) == (right.x, right.height)
