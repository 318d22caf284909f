"""Two poles side by side are a portal, or a tower each."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection.conductors import Span
from scenenet.detection.side_by_side import hold_together, stand_apart

NORTH = np.array([0.0, 1.0])


def held(*passes, bearing=0.0):
    """The conductors at a pole: m to the right of its axis, as seen to the north, and m above its
    foot."""
    turned = 1 if bearing < 90 else -1
    right = np.array([(turned * t, h) for t, h in passes])
    ends = right[:, 0].min(), right[:, 0].max(), right[:, 1].min(), right[:, 1].max()
    return (Span(bearing, 17.0, 1.0, 0.0, *map(float, ends), np.empty((0, 3)), right),)


@pytest.mark.parametrize("bearing", [0.0, 180.0])
def test_a_beam_holds_a_conductor_midway_and_others_outside(bearing):
    left = held((-3, 18), (3, 18), bearing=bearing)
    right = held((-3, 18), (3, 18), bearing=bearing)
    assert hold_together(left, right, NORTH, 6.0)
    assert hold_together(right, left, NORTH, -6.0)
    flag = held((-1, 18), (-1, 15), bearing=bearing)
    assert not hold_together(flag, flag, NORTH, 6.0)


def test_a_conductor_on_one_side_of_a_pole_is_not_outside_both():
    crossarm = held((-1.5, 18), (0, 19), (1.5, 18))
    trunk = held((-1.5, 18))
    assert not hold_together(crossarm, trunk, NORTH, 3.0)


@pytest.mark.parametrize(
    ("passes", "apart"),
    [
        (((1, 22), (-1, 19), (1, 16)), True),
        (((1, 22), (1, 21.5), (-1, 21)), False),  # a crossarm is at one level
        (((3, 22), (-3, 19), (3, 16)), False),  # a beam holds them far from its poles
    ],
)
def test_a_pole_of_its_own_line_holds_conductors_at_several_heights(passes, apart):
    assert stand_apart(held(*passes), held(*passes), 6.0) == apart


def test_both_poles_have_to_hold_conductors_of_their_own():
    flag = held((1, 22), (1, 19), (1, 16))
    assert not stand_apart(flag, held((3, 22)), 6.0)
    assert not stand_apart(flag, (), 6.0)
