"""Distance of a position from the edge of the data."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection.edge_distance import CELL_M, MAX_M, edge_distance

PLACE = np.array([500_123.4, 4_630_567.8])
REACH = 80.0


def field(keep) -> np.ndarray:
    """One point per m^2 around ``PLACE``, where ``keep`` accepts the offset (x, y)."""
    x, y = np.meshgrid(np.arange(-REACH, REACH) + 0.5, np.arange(-REACH, REACH) + 0.5)
    return np.column_stack([x.ravel(), y.ravel()])[keep(x, y).ravel()] + PLACE


def test_inside_the_data_the_distance_is_the_largest():
    assert edge_distance(PLACE, field(lambda x, y: np.ones_like(x, bool))) == MAX_M


@pytest.mark.parametrize("away", [4.0, 11.0, 25.0, 44.0])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1, 1])
def test_the_distance_from_a_straight_edge_is_measured(away, axis, side):
    ground = field(lambda x, y: side * (x, y)[axis] < away)
    assert edge_distance(PLACE, ground) == pytest.approx(away, abs=CELL_M / 2)


def test_the_nearest_edge_counts():
    ground = field(lambda x, y: (x < 30) & (y < 12) & (x > -40))
    assert edge_distance(PLACE, ground) == pytest.approx(12, abs=CELL_M)


def test_a_gap_as_narrow_as_a_shadow_is_no_edge():
    ground = field(lambda x, y: np.abs(x - 10) > 1.5)
    assert edge_distance(PLACE, ground) == pytest.approx(MAX_M, abs=CELL_M)


def test_a_wide_hole_is_an_edge():
    ground = field(lambda x, y: np.hypot(x - 30, y) > 12)
    assert edge_distance(PLACE, ground) == pytest.approx(18, abs=CELL_M)


def test_an_edge_beyond_reach_does_not_count():
    assert edge_distance(PLACE, field(lambda x, y: x < 70)) == MAX_M


def test_outside_the_data_the_distance_is_zero():
    assert edge_distance(PLACE, field(lambda x, y: x > 20)) == 0
    assert edge_distance(PLACE, np.empty((0, 2))) == 0
