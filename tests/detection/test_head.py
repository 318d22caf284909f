"""Crossarms are cells of a plane across the line that stand in free air."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection.head import CELL_M, find_head
from scenenet.detection.profile import Profile

BODY = Profile(0.0, 0.0, 0.4, 0.3, 18.0, 0.9, 0.5)


def head(*parts, reach=1.5, low=14.0, high=18.0, apart=0.0):
    s, t, h = np.concatenate(parts).T
    return find_head(s, t, h, BODY, apart, low, high, reach)


def body(n=400, seed=0):
    rng = np.random.default_rng(seed)
    return np.column_stack(
        [rng.uniform(-0.3, 0.3, n), rng.uniform(-0.3, 0.3, n), rng.uniform(0, 18, n)]
    )


def arm(reach, h, n=60):
    t = np.linspace(-reach, reach, n)
    return np.column_stack([np.zeros(n), t, np.full(n, h)])


def conductor(t, h):
    s = np.arange(-20, 20, 0.1)
    return np.column_stack([s, np.full(len(s), t), np.full(len(s), h)])


def covered(head, t, h):
    return head.covers(np.atleast_1d(float(t)), np.atleast_1d(float(h)))[0]


def test_a_crossarm_is_found_up_to_its_tips():
    found = head(body(), arm(1.9, 16.0))
    assert covered(found, 1.8, 16.0) and covered(found, -1.8, 16.0)
    assert not covered(found, 1.0, 15.0)
    assert found.reach == pytest.approx(2.0, abs=CELL_M)


def test_conductors_that_pass_through_the_plane_are_not_part_of_it():
    found = head(body(), conductor(1.2, 16.2), conductor(-1.2, 16.2))
    assert not covered(found, 1.2, 16.2)


def test_a_crown_is_not_part_of_it():
    rng = np.random.default_rng(1)
    crown = rng.uniform([-3, 0.8, 14], [3, 3, 18], (4000, 3))
    found = head(body(), arm(1.4, 16.0), crown)
    away = crown[(crown[:, 1] > 1.6) & (np.abs(crown[:, 0]) < 0.3)]
    assert found.covers(away[:, 1], away[:, 2]).mean() < 0.15
    assert covered(found, -1.3, 16.0)


def test_what_is_not_connected_with_the_body_is_not_part_of_it():
    apart = arm(0.3, 16.0) + np.array([0, 4.0, 0])
    assert not covered(head(body(), apart, reach=4.0), 4.0, 16.0)


def test_nothing_is_covered_outside_of_the_cells():
    found = head(body(), arm(1.9, 16.0))
    far = np.array([-50.0, 50.0, 0.0, 0.0])
    assert not found.covers(far, np.array([16.0, 16.0, -5.0, 99.0])).any()


def leg(bottom, top, low, high, n=80):
    """A member from ``bottom`` to ``top`` m beside the axis, between two heights."""
    share = np.linspace(0, 1, n)
    return np.column_stack(
        [np.zeros(n), bottom + share * (top - bottom), low + share * (high - low)]
    )


def test_legs_lead_down_from_the_crossarm_to_the_body():
    found = head(body(), arm(3.4, 16.0), leg(0.5, 3.0, 9.0, 16.0), leg(-0.5, -3.0, 9.0, 16.0))
    assert covered(found, 1.6, 12.0) and covered(found, -1.6, 12.0)
    assert not covered(found, 3.0, 12.0)


def test_what_stands_below_and_further_out_than_a_crossarm_is_no_leg():
    beside = leg(3.2, 1.2, 9.0, 13.0)
    found = head(body(), arm(1.9, 16.0), leg(0.5, 1.6, 13.0, 16.0), beside)
    assert covered(found, 1.2, 14.8)
    assert not covered(found, 2.9, 9.6)


def test_the_two_faces_of_a_truss_are_one_crossarm():
    wide = Profile(0.0, 0.0, 2.0, 1.2, 18.0, 0.9, 0.5)
    faces = [arm(6.0, 16.0) + np.array([y, 0, 0]) for y in (-0.7, 0.7)]
    s, t, h = np.concatenate([body(), *faces]).T
    found = find_head(s, t, h, wide, 0.0, 14.0, 18.0, 6.0)
    assert found.thick > 0.7
    assert covered(found, 5.5, 16.0)
