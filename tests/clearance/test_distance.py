"""Distances from conductors, against dense samples of them."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.clearance.crossings import nearest_places
from scenenet.clearance.distance import bounds, nearest_on
from scenenet.line.catenary import Catenary

WIRES = (
    Catenary((0.0, 0.0, 30.0), (120.0, 40.0, 55.0), 400.0),
    Catenary((10.0, -5.0, 60.0), (-300.0, 200.0, 20.0), 900.0),
    Catenary((0.0, 0.0, 20.0), (60.0, 0.0, 20.0), 1e5),
    Catenary((5.0, 0.0, 25.0), (90.0, 150.0, 35.0), 600.0, blowout=-2.5),
)


def sampled(wire: Catenary, step: float = 0.005) -> np.ndarray:
    return wire.at(np.linspace(0.0, wire.length, int(wire.length / step)))


@pytest.mark.parametrize("wire", WIRES)
def test_the_nearest_place_is_that_of_a_dense_sample(wire):
    rng = np.random.default_rng(3)
    s = rng.uniform(-30, wire.length + 30, 60)
    xyz = wire.at(s) + rng.uniform(-1, 1, (60, 3)) * (20, 20, 45)
    found = nearest_on(wire, xyz)
    samples = sampled(wire)
    apart = np.array([np.linalg.norm(samples - place, axis=1).min() for place in xyz])
    np.testing.assert_allclose(found.distance, apart, atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(wire.at(found.along) - xyz, axis=1), found.distance)
    low, high = bounds(wire, xyz)
    assert (low <= found.distance + 1e-9).all() and (found.distance <= high + 1e-9).all()


def test_two_wires_are_as_near_as_their_samples():
    first, second = WIRES[0], Catenary((70.0, -60.0, 25.0), (50.0, 90.0, 22.0), 700.0)
    along, other, distance = nearest_places(first, second)
    samples = sampled(second, 0.02)
    apart = min(np.linalg.norm(samples - place, axis=1).min() for place in sampled(first, 0.1))
    assert distance == pytest.approx(apart, abs=5e-3)
    ends = first.at(np.array([along]))[0], second.at(np.array([other]))[0]
    assert np.linalg.norm(ends[0] - ends[1]) == pytest.approx(distance, abs=1e-6)
