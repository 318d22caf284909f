"""Conductors lead to a support or to the edge of the data; jibs and branches end in the air."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection.conductors import ConductorPoints
from scenenet.detection.following import leads_on
from scenenet.detection.surroundings import surroundings_in

HEIGHT = 15.0


def leads(points, *parts):
    """For each span of a pole with ``parts`` around it, whether it leads on."""
    everything = points.together(points.column(0, 0, 0, HEIGHT), *parts)
    axis = points.place[:2] + 0.5
    base = float(points.place[2])
    around = surroundings_in(everything)
    spans = ConductorPoints(around, 4.5).leaving(axis, base, HEIGHT, 4.0, around)
    assert spans
    occupied = np.unique(np.floor(everything), axis=0) + 0.5
    return [leads_on(span, axis, base, occupied, 1.0) for span in spans]


def test_a_conductor_to_the_next_support_leads_on(points):
    line = points.conductors(90, HEIGHT, end=45.0)
    support = points.column(45, 0, 0, HEIGHT)
    assert leads(points, points.ground(80), line, support) == [True]


def test_a_conductor_to_the_edge_of_the_data_leads_on(points):
    line = points.conductors(90, HEIGHT, end=28.0)
    assert leads(points, points.ground(28), line) == [True]


def test_a_conductor_that_goes_far_leads_on(points):
    line = points.conductors(90, HEIGHT, end=75.0)
    assert leads(points, points.ground(100), line) == [True]


@pytest.mark.parametrize("length", [15.0, 30.0, 45.0])
def test_a_jib_ends_in_the_air(points, length):
    jib = points.conductors(90, HEIGHT, end=length, beside=(0.0,))
    assert leads(points, points.ground(80), jib) == [False]


def test_a_roof_below_the_end_of_a_jib_is_no_support(points):
    jib = points.conductors(90, HEIGHT, end=30.0, beside=(0.0,))
    roof = points.block(np.arange(20, 40, 0.5), np.arange(-8, 8, 0.5), [5.0])
    assert leads(points, points.ground(80), jib, roof) == [False]


def test_returns_may_be_missing_for_ten_metres(points):
    line = points.conductors(90, HEIGHT, end=75.0)
    s = line[:, 0] - points.place[0]
    seen = line[(s < 25) | (s > 33)]
    assert leads(points, points.ground(100), seen) == [True]


def test_a_conductor_over_a_slope_is_followed(points):
    line = points.conductors(90, HEIGHT, end=75.0)
    line[:, 2] += 0.2 * (line[:, 0] - points.place[0])
    assert leads(points, points.ground(100, slope=0.2), line) == [True]


@pytest.mark.parametrize("climb", [-0.9, 0.9])
def test_a_conductor_up_or_down_a_steep_slope_leads_on(points, climb):
    line = points.conductors(90, HEIGHT, end=75.0)
    line[:, 2] += climb * (line[:, 0] - points.place[0] - 0.5)
    assert leads(points, points.ground(100, slope=climb), line) == [True]
