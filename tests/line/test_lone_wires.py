"""Wires without a tower at both ends."""

from __future__ import annotations

import multiprocessing

import numpy as np

from scenenet.line.lone_wires import lone_spans
from scenenet.line.traced_spans import LineTower
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
