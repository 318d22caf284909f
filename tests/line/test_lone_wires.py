"""Wires without a tower at both ends."""

from __future__ import annotations

import multiprocessing

import numpy as np
from fixtures.line_scene import points_on

from scenenet.line.catenary import Catenary
from scenenet.line.lone_wires import lone_spans
from scenenet.line.traced_spans import LineTower, TracedSpan
from scenenet.line.wire_points import WirePoints


def search() -> None:
    """Points that belong to no wire: left and right of a tower in a stretch, and some beside its
    longer part, which keep the stretch together."""
    rng = np.random.default_rng(0)
    row = np.column_stack(
        (rng.uniform(0, 20, 300), rng.uniform(-1, 1, 300), rng.uniform(5, 9, 300))
    )
    beside = np.array([(x, 5.0, 7.0) for x in range(0, 14, 3)])
    xyz = np.concatenate((row, beside))
    points = WirePoints(xyz, np.ones(len(xyz), bool))
    tower = LineTower(1, 12.8, 1.0, 0.0, 24.0, 0.4)
    assert lone_spans(points, np.ones(len(xyz), bool), [tower]) == []


def test_the_search_ends_where_the_longest_part_of_a_stretch_was_looked_at():
    process = multiprocessing.get_context("fork").Process(target=search)
    process.start()
    process.join(60)
    ended = process.exitcode
    process.kill()
    assert ended == 0


def leaving(earth: list[Catenary]) -> list[TracedSpan]:
    """The spans that leave a tower at x = 0 with three conductors, 320 m long, and pieces of an
    earth wire with 1.6 points per metre."""
    rng = np.random.default_rng(0)
    conductors = [Catenary((0.0, t, 24.0), (320.0, t, 20.0), 1400.0) for t in (-6.0, 0.0, 6.0)]
    parts = [points_on(wire, 0.3, rng) for wire in conductors]
    parts += [points_on(wire, 0.62, rng) for wire in earth]
    xyz = np.concatenate(parts)
    points = WirePoints(xyz, np.ones(len(xyz), bool))
    tower = LineTower(1, 0.0, 0.0, 0.0, 36.0, 4.0)
    return lone_spans(points, np.ones(len(xyz), bool), [tower])


EARTH = Catenary((0.0, 1.0, 34.0), (320.0, 1.0, 31.0), 1700.0)


def test_an_earth_wire_that_is_hidden_over_a_third_of_its_span_is_one_wire():
    (span,) = leaving([EARTH.between(2.0, 56.0), EARTH.between(180.0, 318.0)])
    assert len(span.wires) == 4
    assert min(wire.catenary.length for wire in span.wires) > 312
    seen = min(wire.covered for wire in span.wires)
    assert 0.5 < seen < 0.7
    off = [
        np.abs(wire.catenary.residuals(EARTH.at_shares(np.linspace(0, 1, 9))))
        for wire in span.wires
    ]
    assert min(np.max(each) for each in off) < 0.15


def test_pieces_that_are_on_no_common_catenary_are_not_joined():
    beside = Catenary((0.0, 5.0, 34.0), (320.0, 5.0, 31.0), 1700.0)
    spans = leaving([EARTH.between(2.0, 56.0), beside.between(180.0, 318.0)])
    *_, shortest = sorted((w.catenary.length for s in spans for w in s.wires), reverse=True)
    assert shortest < 150
