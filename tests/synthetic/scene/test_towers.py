"""Towers and the conductors between them."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from scenenet.synthetic.returns.conductors import string_conductors
from scenenet.synthetic.scene.towers import KINDS, Size, place, sample
from scenenet.synthetic.settings import SyntheticSettings

KINDS_AND_CIRCUITS = [(kind, circuits) for kind in KINDS for circuits in (1, 2)]


@pytest.mark.parametrize(("kind", "circuits"), KINDS_AND_CIRCUITS)
def test_a_tower_has_the_requested_height_and_stands_on_its_foot(kind, circuits):
    tower = KINDS[kind](18.0, circuits, 1)
    ends = tower.members[:, :6].reshape(-1, 3)
    assert ends[:, 2].max() == pytest.approx(18.0, abs=0.25)
    assert ends[:, 2].min() < 0, "legs go on below the foot, for slopes"


@pytest.mark.parametrize(("kind", "circuits"), KINDS_AND_CIRCUITS)
@pytest.mark.parametrize("earth_wires", [0, 1])
def test_every_conductor_is_attached_to_the_tower(kind, circuits, earth_wires):
    tower = KINDS[kind](18.0, circuits, earth_wires)
    assert tower.attachments.shape == (3 * circuits + earth_wires, 3)
    ends = tower.members[:, :6].reshape(-1, 3)
    for conductor in tower.attachments:
        assert np.linalg.norm(ends - conductor, axis=1).min() < 0.3
    assert tower.attachments[:, 2].min() > 0.6 * 18.0


def test_pylon_has_the_square_base_of_the_thesis():
    tower = KINDS["lattice"](34.74, 1, 0)
    assert 2 * tower.half_base == pytest.approx(4.15, rel=0.02)
    ends = tower.members[:, :6].reshape(-1, 3)
    foot = ends[ends[:, 2] == 0]
    np.testing.assert_allclose(np.abs(foot[:, :2]), tower.half_base)
    high = ends[np.abs(ends[:, 2] - 0.94 * 34.74) < 1e-9]
    assert np.abs(high[:, :2]).max() < 0.4 * tower.half_base, "a pyramid narrows"


def test_kinds_differ():
    counts = {kind: len(KINDS[kind](18.0, 1, 0).members) for kind in KINDS}
    assert len(set(counts.values())) >= 4


def test_sampled_points_lie_on_the_members_with_one_density():
    members = np.array([[0, 0, 0, 0, 0, 30, 0.5, 0.5], [0, 0, 10, 8, 0, 10, 0.1, 0.1]], float)
    points = sample(members, 200.0, np.random.default_rng(0))
    mast = np.abs(np.hypot(points[:, 0], points[:, 1]) - 0.5) < 1e-9
    arm = np.abs(np.hypot(points[:, 1], points[:, 2] - 10) - 0.1) < 1e-9
    assert (mast | arm).all()
    assert mast.sum() == pytest.approx(200 * 30 * np.pi, rel=0.05)
    assert (arm & ~mast).sum() == pytest.approx(200 * 8 * np.pi * 0.2, rel=0.1)


def test_arms_stand_across_the_line():
    east = place(np.array([[1.0, 0.0, 2.0], [0.0, 1.0, 2.0]]), 10, 20, 30, azimuth=0.0)
    np.testing.assert_allclose(east, [[10, 19, 32], [11, 20, 32]], atol=1e-12)


def test_scan_lines_meet_conductors_in_the_scanned_part_only():
    starts, ends = np.array([[0, -1, 10], [0, 1, 10.0]]), np.array([[100, -1, 10], [100, 1, 10.0]])
    rng = np.random.default_rng(0)
    points = string_conductors(starts, ends, 900.0, 0.2, 0.8, rng, (0.25, 0.75))
    assert points[:, 0].min() >= 25
    assert points[:, 0].max() <= 75
    assert len(points) == pytest.approx(2 * 50 / 0.2 * 0.8, rel=0.1)
    steps = np.diff(np.sort(points[points[:, 1] < 0, 0]))
    assert np.median(steps) == pytest.approx(0.2, rel=0.2), "in steps, not anywhere"


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_width_and_reach_can_be_prescribed(kind):
    """The body is as wide at a third of its height as said, and the longest cross-arm as long."""
    height, size = 24.0, Size(width=1.6, reach=5.0)
    tower = KINDS[kind](height, 1, 0, size)
    points = sample(tower.members, 400.0, np.random.default_rng(0))
    body = points[np.abs(points[:, 2] - height / 3) < 1]
    assert 2 * np.abs(body[:, 0]).max() == pytest.approx(1.6, abs=0.45)
    assert np.abs(points[:, 0]).max() == pytest.approx(5.0, abs=0.15)
    assert np.abs(tower.attachments[:, 0]).max() == pytest.approx(5.0)
    of_its_kind = KINDS[kind](height, 1, 0)
    np.testing.assert_array_equal(KINDS[kind](height, 1, 0, Size()).members, of_its_kind.members)


def test_crossarms_that_stay_in_the_body_are_refused():
    with pytest.raises(ValidationError, match="do not leave a body 4 m wide"):
        SyntheticSettings(body_width=4.0, arm_reach=2.0)
