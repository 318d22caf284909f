"""Conductors lead to a support or to the edge of the data; jibs and branches end in the air."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection.conductors import leaving_spans
from scenenet.detection.following import leads_on

HEIGHT = 15.0


def leads(lattice, *parts):
    """For each span of a pole with ``parts`` around it, whether it leads on."""
    everything = lattice.together(lattice.column(0, 0, 0, HEIGHT), *parts)
    axis = lattice.place[:2] + 0.5
    base = float(lattice.place[2])
    spans = leaving_spans(everything, (axis[0], axis[1]), base, HEIGHT, 4.0, 1.0)
    assert spans
    return [leads_on(span, axis, base, everything, 1.0) for span in spans]


def test_a_conductor_to_the_next_support_leads_on(lattice):
    line = lattice.conductors(90, HEIGHT, end=45.0)
    support = lattice.column(45, 0, 0, HEIGHT)
    assert leads(lattice, lattice.ground(80), line, support) == [True]


def test_a_conductor_to_the_edge_of_the_data_leads_on(lattice):
    line = lattice.conductors(90, HEIGHT, end=28.0)
    assert leads(lattice, lattice.ground(28), line) == [True]


def test_a_conductor_that_goes_far_leads_on(lattice):
    line = lattice.conductors(90, HEIGHT, end=75.0)
    assert leads(lattice, lattice.ground(100), line) == [True]


@pytest.mark.parametrize("length", [15.0, 30.0, 45.0])
def test_a_jib_ends_in_the_air(lattice, length):
    jib = lattice.conductors(90, HEIGHT, end=length, beside=(0.0,))
    assert leads(lattice, lattice.ground(80), jib) == [False]


def test_a_roof_below_the_end_of_a_jib_is_no_support(lattice):
    jib = lattice.conductors(90, HEIGHT, end=30.0, beside=(0.0,))
    x, y = (side.ravel() for side in np.meshgrid(np.arange(20, 40), np.arange(-8, 8)))
    roof = lattice.voxels(np.column_stack([x, y, np.full(len(x), 5)]))
    assert leads(lattice, lattice.ground(80), jib, roof) == [False]


def test_returns_may_be_missing_for_ten_metres(lattice):
    line = lattice.conductors(90, HEIGHT, end=75.0)
    s = line[:, 0] - lattice.place[0]
    seen = line[(s < 25) | (s > 33)]
    assert leads(lattice, lattice.ground(100), seen) == [True]


def test_a_conductor_over_a_slope_is_followed(lattice):
    line = lattice.conductors(90, HEIGHT, end=75.0)
    line[:, 2] += np.rint(0.2 * (line[:, 0] - lattice.place[0]))
    assert leads(lattice, lattice.ground(100, slope=0.2), line) == [True]
