"""Tension towers end their conductors, and jumpers lead around them."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.synthetic.codes import CONDUCTOR, TOWER
from scenenet.synthetic.corridor import Corridor
from scenenet.synthetic.scene.tension import DIP, SHORTEST_STRING_M, jumper, strung
from scenenet.synthetic.scene.towers import KINDS
from scenenet.synthetic.settings import SyntheticSettings


@pytest.mark.parametrize("kind", KINDS)
def test_strings_lie_along_both_spans(kind):
    tower, half_turn = KINDS[kind](30.0, 2, 1), np.radians(10)
    made = strung(tower, half_turn)
    rows = list(tower.insulators)
    anchors = tower.members[rows, :3]
    assert len(anchors) == 6
    for held, side in ((made.behind, -1), (made.ahead, 1)):
        strings = held[:6] - anchors
        length = np.linalg.norm(strings[:, :2], axis=1)
        assert (length >= SHORTEST_STRING_M - 1e-9).all()
        np.testing.assert_allclose(strings[:, 2], -DIP * length)
        # Both spans turn away from x to the left, the one behind as seen from its start.
        np.testing.assert_allclose(strings[:, 0] / length, -np.sin(half_turn))
        np.testing.assert_allclose(strings[:, 1] / length, side * np.cos(half_turn))
        np.testing.assert_array_equal(held[6:], tower.attachments[6:])
    assert len(made.structure.members) == len(tower.members) + 6
    body = np.delete(tower.members, rows, axis=0)
    np.testing.assert_array_equal(made.structure.members[: len(body)], body)


def test_a_jumper_hangs_below_its_ends_and_may_be_led_aside():
    start, end = np.array([0.0, 0.0, 20.0]), np.array([4.0, 0.0, 20.0])
    middle = jumper(start, end, aside=False).at_shares(np.array([0.5]))[0]
    assert 18.0 < middle[2] < 18.6 and middle[1] == 0
    assert jumper(start, end, aside=True).at_shares(np.array([0.5]))[0, 1] == pytest.approx(0.6)


@pytest.fixture(scope="module")
def corridor() -> Corridor:
    return Corridor(
        SyntheticSettings(
            towers=4, seed=3, kinds={"lattice": 1.0}, height=(24, 30), span=120, section=0,
            margin=20.0, tension=0.4, bend_share=0.5, other_lines=0, ranging_noise=0.0,
        )
    )  # fmt: skip


def test_every_bend_has_a_tension_tower(corridor):
    turns = np.abs(np.diff(corridor.line.headings)) > 0
    supports = [corridor.line.support(k) for k in range(1, 5)]
    assert turns.any() and not turns.all()
    for support, bend in zip(supports, turns, strict=True):
        assert support.tension or not bend
        assert support.tension == (np.abs(support.behind - support.ahead).max() > 0)


def test_catenaries_end_at_strings_and_jumpers_are_conductors(corridor):
    stretches = list(corridor)
    for number in range(1, 5):
        support = corridor.line.support(number)
        held = np.concatenate((support.behind, support.ahead)) + corridor._origin
        ends = np.array([
            end for wire in corridor.conductors for tower, end in (
                (wire.from_tower, wire.catenary.start), (wire.to_tower, wire.catenary.end)
            ) if tower == number
        ])  # fmt: skip
        apart = np.linalg.norm(ends[:, None] - held[None], axis=2).min(axis=1)
        assert apart.max() < 1e-6
        xyz, truth = stretches[number - 1].xyz, stretches[number - 1].truth
        own = xyz[truth == CONDUCTOR]
        near = np.hypot(own[:, 0] - support.x - corridor._origin[0],
                        own[:, 1] - support.y - corridor._origin[1])  # fmt: skip
        middle = (support.behind + support.ahead)[:3] / 2 + corridor._origin
        below = [
            ((np.hypot(*(own - m)[:, :2].T) < 0.3) & (own[:, 2] < m[2] - 0.5)).sum() for m in middle
        ]
        assert all(below) == support.tension, near.min()
        assert (truth == TOWER).any()
