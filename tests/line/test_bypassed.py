"""A tree beside a span is not a tower if the conductors of the span go on past it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fixtures.line_scene import PYLONS, known_line

from scenenet.line.bypassed import bypassed_towers
from scenenet.line.find_line import find_line
from scenenet.line.traced_spans import ABOVE_TOP_M, LineTower

TREE = 99


@pytest.fixture(scope="module")
def known():
    return known_line(**{**PYLONS, "towers": 3})


@pytest.fixture(scope="module")
def line(known):
    return find_line(known.points, known.towers, known.to_its_ends)


@pytest.fixture(scope="module")
def passing(known, line):
    """The span between the first two towers, and its conductors."""
    ids = {tower.id for tower in known.towers[:2]}
    [span] = [span for span in line.spans if {span.from_tower, span.to_tower} == ids]
    return span, [wire for wire in line.conductors if wire.span_id == span.span_id]


def tree(
    passing, under: float, beside: float = 2.0, turned: float = 0.0, width: float = 0.6
) -> LineTower:
    """A tree beside the lowest conductor, ``under`` m below it and ``beside`` m to its left, at
    which conductors seem to leave along the span, or ``turned`` degrees away."""
    _, wires = passing
    wire = min(wires, key=lambda one: one.catenary.at_shares(np.array([0.4]))[0, 2])
    x, y, z = wire.catenary.at_shares(np.array([0.4]))[0].tolist()
    east, north = wire.catenary.direction.tolist()
    bearing = float(np.degrees(np.arctan2(east, north))) + turned
    height = 12.0
    x, y = x - beside * north, y + beside * east
    bearings = (bearing % 360, (bearing + 180) % 360)
    return LineTower(TREE, x, y, z - under - height, height, width, bearings)


def dropped(known, line, found: LineTower, spans=(), wires=()):
    return bypassed_towers(
        [*known.towers, found], [*line.spans, *spans], [*line.conductors, *wires]
    )  # fmt: skip


@pytest.mark.parametrize(
    ("under", "beside", "turned", "width", "expected"),
    [
        (ABOVE_TOP_M + 1.0, 2.0, 0.0, 0.6, {TREE}),
        # A pole may hold wires at this height: those of a line that was not traced.
        (ABOVE_TOP_M - 1.0, 2.0, 0.0, 0.6, set()),
        # What is wider would hold those of the span, and they do not bend.
        (ABOVE_TOP_M - 1.0, 2.0, 0.0, 3.0, {TREE}),
        # Its conductors cross those of the span, or pass far from it: it is of another line.
        (ABOVE_TOP_M + 1.0, 2.0, 60.0, 0.6, set()),
        (ABOVE_TOP_M + 1.0, 9.0, 0.0, 0.6, set()),
        (ABOVE_TOP_M - 1.0, 9.0, 0.0, 3.0, set()),
    ],
)
def test_a_low_tree_beside_a_span_is_no_tower(
    known, line, passing, under, beside, turned, width, expected
):
    found = tree(passing, under, beside, turned, width)
    assert dropped(known, line, found) == expected


@pytest.mark.parametrize(
    ("to", "share", "expected"),
    [
        # A tree takes one conductor; a tower would hold as many as the span has; and one that
        # leads to a third tower is of another line.
        ("next", 0.2, {TREE}),
        ("air", 0.2, {TREE}),
        ("next", 1.0, set()),
        ("third", 0.2, set()),
    ],
)
def test_a_tree_with_few_of_the_conductors_is_no_tower(known, line, passing, to, share, expected):
    span, wires = passing
    end = {"next": span.to_tower, "air": 0, "third": known.towers[2].id}[to]
    # As traced from the tree on: points of the same wires, in a span of its own.
    number = round(share * len(wires))
    held = [replace(wire, span_id=1, from_tower=TREE, to_tower=end) for wire in wires[:number]]
    own = replace(span, span_id=1, from_tower=TREE, to_tower=end, conductors=number)
    found = tree(passing, under=0.5)
    assert dropped(known, line, found, [own], held) == expected


def test_towers_of_the_line_stay(known, line, pylons, poles):
    assert bypassed_towers(known.towers, line.spans, line.conductors) == set()
    for other in (pylons, poles):
        found = find_line(other.points, other.towers, other.to_its_ends)
        assert bypassed_towers(other.towers, found.spans, found.conductors) == set()
