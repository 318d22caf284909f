"""The direction of the line at a tower."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection.conductors import Span
from scenenet.detection.line_frame import direction_of


def span(bearing: float) -> Span:
    return Span(bearing, 20.0, 1.0, 0.0, -3.0, 3.0, 12.0, 18.0, np.empty((0, 3)))


def bearing_of(*bearings: float) -> float:
    """Degrees from -1 to 179, of the line at a tower with spans of these bearings."""
    along = direction_of(tuple(map(span, bearings)))
    assert np.hypot(*along) == pytest.approx(1.0)
    return float((np.degrees(np.arctan2(*along)) + 1) % 180 - 1)


@pytest.mark.parametrize("turn", [0.0, 30.0, 59.0, 61.0, 68.0, 90.0, 104.0])
def test_crossarms_halve_the_angle_of_the_line_at_a_tower(turn):
    assert bearing_of(0.0, 180.0 + turn) == pytest.approx(turn / 2, abs=1e-6)


def test_two_spans_to_about_the_same_side_are_no_turn():
    assert bearing_of(20.0, 80.0) == pytest.approx(20.0)


def test_a_span_that_branches_off_does_not_turn_the_line():
    assert bearing_of(0.0, 90.0, 180.0) == pytest.approx(0.0, abs=1e-6)


def test_a_tower_without_conductors_has_the_direction_north():
    assert bearing_of() == pytest.approx(0.0, abs=1e-6)
