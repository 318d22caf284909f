"""Points in voxels of wires that are on no traced wire."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.clearance.untraced import untraced


def along(length: float, t: float = 3.2, drift: float = 0.0, step: float = 0.8) -> np.ndarray:
    """Points of something straight along the span, that moves sideways by ``drift`` m."""
    s = np.arange(0.0, length, step)
    return np.column_stack((s, t + drift * s / length, 20.0 + 0.01 * (s - length / 2) ** 2))


@pytest.mark.parametrize("drift", [0.0, 2.5, -2.5])
def test_a_wire_along_the_span_is_one_up_to_its_ends(drift):
    assert untraced(along(90.0, drift=drift)).all()


def test_a_wire_of_which_few_points_are_seen_is_one():
    wire = along(90.0)
    seen = np.random.default_rng(0).random(len(wire)) < 0.8
    assert untraced(wire[seen]).mean() > 0.95


def test_a_jib_across_the_span_and_one_along_it_are_none():
    jib = along(11.0)
    assert not untraced(jib).any()
    assert not untraced(along(60.0)[:, [1, 0, 2]]).any()


def test_twigs_beside_a_wire_stay_obstacles():
    rng = np.random.default_rng(0)
    twigs = np.column_stack(
        (rng.uniform(40, 46, 60), rng.uniform(7, 8, 60), rng.uniform(18, 20, 60))
    )
    found = untraced(np.concatenate((along(90.0), twigs)))
    assert found[:-60].all() and not found[-60:].any()


def test_without_points_there_is_none():
    assert untraced(np.empty((0, 3))).shape == (0,)
