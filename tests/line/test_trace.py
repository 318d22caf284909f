"""The wires among the points of a span."""

from __future__ import annotations

import numpy as np
import pytest
from fixtures.line_scene import points_on

from scenenet.line.catenary import Catenary
from scenenet.line.frame import SpanFrame
from scenenet.line.trace import trace_wires
from scenenet.line.traced_spans import WORST_M, traced
from scenenet.line.wire_points import WirePoints

BUNDLES = [
    [(-0.2, 0), (0.2, 0)],
    [(-0.2, 0), (0.2, 0), (0, -0.4)],
    [(-0.2, 0), (0.2, 0), (-0.2, -0.4), (0.2, -0.4)],
]


def catenary(t: float, z: float) -> Catenary:
    return Catenary((0.0, t, z), (280.0, t + 1.5, z + 6.0), 1200.0)


def shifted(wire: Catenary, t: float) -> Catenary:
    """The same wire, moved by t m to the left."""
    (x, y, z), (far_x, far_y, far_z) = wire.start, wire.end
    return Catenary((x, y + t, z), (far_x, far_y + t, far_z), wire.parameter)


def nearest(wires, true: Catenary) -> float:
    """m, median distance of a true wire from the nearest one found."""
    places = true.at_shares(np.linspace(0.1, 0.9, 30))
    found = [np.median(np.hypot(*w.fit.catenary.residuals(places))) for w in wires]
    return min(found, default=np.inf)


def test_wires_side_by_side_are_told_apart():
    rng = np.random.default_rng(0)
    true = [catenary(t, z) for t in (-4.0, 0.0, 1.0, 4.0) for z in (20.0, 21.2)]
    wires = trace_wires(np.concatenate([points_on(wire, 1.0, rng) for wire in true]))
    assert len(wires) == len(true)
    assert max(nearest(wires, wire) for wire in true) < 0.03
    assert {len(wire.offsets) for wire in wires} == {1}


@pytest.mark.parametrize("places", BUNDLES, ids=len)
def test_a_bundle_is_one_wire_with_its_number(places):
    rng = np.random.default_rng(0)
    parts = [points_on(catenary(5.0 + t, 25.0 + z), 1.0, rng) for t, z in places]
    (wire,) = trace_wires(np.concatenate(parts))
    assert len(wire.offsets) == len(places)
    t, z = (np.array(places).min(axis=0) + np.array(places).max(axis=0)) / 2
    assert nearest([wire], catenary(5.0 + t, 25.0 + z)) < 0.03
    assert wire.fit.rmse < 0.06


def test_a_gap_is_bridged_where_the_catenary_says_so():
    points = points_on(catenary(0.0, 25.0), 1.0, np.random.default_rng(0))
    hidden = (points[:, 0] > 110) & (points[:, 0] < 160)
    (wire,) = trace_wires(points[~hidden])
    assert wire.fit.catenary.length > 270
    assert 0.75 < wire.covered < 0.9
    assert nearest([wire], catenary(0.0, 25.0)) < 0.03


@pytest.mark.parametrize("seed", [5, 8, 21, 22])
def test_a_bundle_over_a_crown_is_found_from_end_to_end(seed):
    """Its first fit goes from one wire of the bundle to the other, and holds a part of them."""
    rng = np.random.default_rng(seed)
    true = [
        Catenary((0.0, t, z), (190.0, t + 1.2, z - 22.0), 1600.0)
        for t in (-9.5, -0.5)
        for z in (279.0, 284.0, 288.6)
    ]
    pairs = [shifted(wire, t) for wire in true for t in (-0.2, 0.2)]
    crown = rng.normal((84.0, -9.6, 263.5), (4.0, 2.0, 1.2), (150, 3))
    wires = trace_wires(np.concatenate([*(points_on(w, 2.3, rng) for w in pairs), crown]))
    assert len(wires) == len(true)
    assert min(wire.fit.catenary.length for wire in wires) > 185


def test_a_bundle_that_crowns_hide_in_parts_is_one_wire():
    """The pieces of one side of a bundle are followed first, and miss the rest of it."""
    rng = np.random.default_rng(2)
    sides = [points_on(catenary(5.0 + t, 25.0), 1.0, rng) for t in (-0.2, 0.2)]
    points, side = np.concatenate(sides), np.repeat([0, 1], [len(points) for points in sides])
    seen = np.ones(len(points), bool)
    for _ in range(8):
        start, length = rng.uniform(20, 250), rng.uniform(4, 16)
        hidden = (points[:, 0] > start) & (points[:, 0] < start + length)
        of_one = rng.integers(0, 3)
        seen &= ~(hidden & ((side == of_one) | (of_one == 2)))
    (wire,) = trace_wires(points[seen], gap=200.0)
    assert wire.fit.catenary.length > 270
    assert nearest([wire], catenary(5.0, 25.0)) < 0.03


def test_wires_that_meet_at_a_crossarm_are_two():
    rng = np.random.default_rng(0)
    # A straight line from end to end is nowhere further than 0.4 m from either.
    true = [Catenary((s, 0.0, 20.0), (s + 75.0, 0.0, 20.0), 900.0) for s in (0.0, 75.0)]
    wires = trace_wires(np.concatenate([points_on(wire, 1.0, rng) for wire in true]))
    assert len(wires) == 2
    assert max(nearest(wires, wire) for wire in true) < 0.03
    assert [wire.fit.catenary.parameter for wire in wires] == pytest.approx([900, 900], rel=0.05)


def test_leaves_hide_no_wire_and_make_none_from_tower_to_tower():
    rng = np.random.default_rng(5)
    leaves = rng.uniform((60.0, -8.0, 10.0), (120.0, 8.0, 24.0), (3000, 3))
    true = catenary(0.0, 22.0)
    wires = trace_wires(np.concatenate([points_on(true, 0.8, rng), leaves]))
    long = [w for w in wires if w.fit.rmse < WORST_M and w.fit.catenary.length > 60.0]
    assert len(long) == 1
    assert nearest(long, true) < 0.05


def among(xyz: np.ndarray):
    """The wires among points that are all certain, along the axis of x."""
    points = WirePoints(xyz, np.ones(len(xyz), bool))
    frame = SpanFrame(0.0, 0.0, np.array([1.0, 0.0]), 280.0)
    return traced(points, np.arange(len(xyz)), frame)


@pytest.mark.parametrize("places", BUNDLES, ids=len)
def test_a_bundle_in_free_air_is_a_wire_where_noise_hides_how_many_wires_it_has(places):
    rng = np.random.default_rng(0)
    parts = [points_on(catenary(5.0 + t, 25.0 + z), 1.0, rng) for t, z in places]
    noisy = np.concatenate(parts)
    noisy = noisy + rng.normal(0, 0.1, noisy.shape)
    (wire,) = among(noisy)
    assert wire.rmse > WORST_M
    assert wire.catenary.length > 250.0


def test_leaves_as_far_from_a_curve_as_the_wires_of_a_bundle_are_no_wire():
    rng = np.random.default_rng(0)
    along = catenary(5.0, 25.0).at(rng.uniform(0.0, 280.0, 2500))
    assert among(along + rng.uniform((0.0, -1.2, -1.2), (0.0, 1.2, 1.2), along.shape)) == ()


def test_nothing_gives_nothing():
    assert trace_wires(np.empty((0, 3))) == []
    assert trace_wires(np.zeros((5, 3))) == []
