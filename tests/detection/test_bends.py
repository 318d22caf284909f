"""Conductors that bend where they are carried."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenenet.detection.bends import pass_without_bend
from scenenet.detection.conductors import Span

AXIS = np.array([500.0, 700.0])
CATENARY_M = 1000.0


def spans(
    rise: float = 0.0, turn: float = 0.0, ahead: float = 20.0, bundle: float = 0.0, seed: int = 1
) -> tuple[Span, Span]:
    """Three conductors that leave in two directions, as points with noise of 2 cm.

    Args:
        rise: change of slope at the axis, m per m.
        turn: change of direction at the axis, degrees.
        ahead: m up to which they are seen in the first direction.
        bundle: m between the two wires of each; each point is on one of them.
    """
    rng = np.random.default_rng(seed)
    both = []
    for bearing, end in ((20 + turn, ahead), (200, 20.0)):
        s = np.arange(3, end, 0.7)
        heading = np.array([np.sin(np.radians(bearing)), np.cos(np.radians(bearing))])
        right = np.array([heading[1], -heading[0]])
        side = bundle / 2 * rng.choice([-1, 1], (len(s), 1))
        wires = [
            np.column_stack(
                [
                    AXIS + s[:, None] * heading + (t + side) * right,
                    z + rise / 2 * s + s**2 / 2 / CATENARY_M,
                ]
            )
            for t, z in ((-3.0, 20.0), (0.0, 22.0), (3.0, 20.0))
        ]
        places = np.concatenate(wires)
        places += 0.02 * rng.standard_normal(places.shape)
        slope = rise / 2 + 11.5 / CATENARY_M
        both.append(Span(bearing, end - 3, 1.0, slope, -3, 3, 20, 22, places))
    return both[0], both[1]


def test_conductors_pass_a_tree_between_towers_without_a_bend():
    assert pass_without_bend(spans(), AXIS)


@pytest.mark.parametrize("rise", [-0.2, -0.06, 0.06], ids=["crest", "level ground", "valley"])
def test_a_tower_holds_conductors_up_or_down(rise):
    assert not pass_without_bend(spans(rise), AXIS)


@pytest.mark.parametrize("seed", range(20))
def test_a_bundle_passes_a_tree_without_a_bend(seed):
    """The middle conductor alone, so that no other corrects what its two wires seem to do."""
    both = spans(bundle=0.4, seed=seed)
    n = len(both[0].places) // 3
    ahead, behind = (replace(span, places=span.places[n : 2 * n]) for span in both)
    assert pass_without_bend((ahead, behind), AXIS)


def test_a_tower_turns_conductors():
    assert not pass_without_bend(spans(turn=4.0), AXIS)
    assert not pass_without_bend(spans(turn=4.0, bundle=0.4), AXIS)


def test_conductors_on_one_side_do_not_say_whether_they_bend():
    assert not pass_without_bend(spans()[:1], AXIS)
    assert not pass_without_bend(spans(ahead=6.0), AXIS)
    assert not pass_without_bend((), AXIS)


def test_other_conductors_on_the_other_side_do_not_continue_these():
    ahead, behind = spans()
    higher = behind.places + np.array([0.0, 0.0, 5.0])
    moved = Span(200, 17, 1.0, behind.slope, -3, 3, 25, 27, higher)
    assert not pass_without_bend((ahead, moved), AXIS)
