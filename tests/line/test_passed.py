"""Conductors bend at a tower; at a tree amid them they run on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fixtures.line_scene import PYLONS, known_line

from scenenet.line.find_line import find_line
from scenenet.line.passed import passed_towers
from scenenet.line.traced_spans import LineTower

WIDE_M = 4.0


@pytest.fixture(scope="module")
def known():
    return known_line(**{**PYLONS, "towers": 3})


def amid(known, share, width, height=None, beside=0.0):
    """What seems to be a tower under the first span, at a share of its length."""
    one, other = known.towers[:2]
    way = other.place - one.place
    left = np.array([-way[1], way[0]]) / np.hypot(*way)
    x, y = one.place + share * way + beside * left
    base = one.base + share * (other.base - one.base)
    return LineTower(99, float(x), float(y), base, height or one.height + 10.0, width)


@pytest.mark.parametrize(
    ("width", "height", "beside", "expected"),
    [
        (WIDE_M, None, 0.0, {99}),
        (0.5, None, 0.0, set()),
        (0.5, 13.0, 0.0, set()),
        # No pole of 13 m has a crossarm of 8 m.
        (0.5, 13.0, 5.0, {99}),
    ],
)
def test_a_tree_amid_the_conductors_is_no_tower_and_a_pole_may_be_one(
    known, width, height, beside, expected
):
    towers = [replace(tower, width=WIDE_M) for tower in known.towers]
    towers.append(amid(known, 0.4, width, height, beside))
    line = find_line(known.points, towers, known.to_its_ends)
    assert {99} <= {end for span in line.spans for end in (span.from_tower, span.to_tower)}
    assert passed_towers(towers, line.conductors) == expected


def test_a_tower_without_conductors_on_both_sides_is_not_judged(known):
    towers = [replace(tower, width=WIDE_M) for tower in known.towers]
    line = find_line(known.points, towers, known.to_its_ends)
    ended = [c for c in line.conductors if towers[1].id != c.to_tower]
    assert passed_towers(towers, ended) == set()
