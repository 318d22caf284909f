"""Wires of a tower at the edge of a survey."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fixtures.line_scene import KnownLine

from scenenet.line.edge_spans import EDGE_M, edge_spans
from scenenet.line.find_line import find_line
from scenenet.line.records import SurveyLine
from scenenet.line.traced_spans import LineTower
from scenenet.line.wire_points import WirePoints


def bearings(known: KnownLine, number: int, off: float = 0.0) -> tuple[float, ...]:
    """Degrees, of the neighbours of a tower as seen from it, and by how much they are wrong."""
    here = known.towers[number].place
    ways = [known.towers[other].place - here for other in (number - 1, number + 1)]
    return tuple(float(np.degrees(np.arctan2(*way)) + off) % 360 for way in ways)


def cut(known: KnownLine, number: int, radius: float) -> WirePoints:
    """The points of wires within a radius in m of a tower."""
    near = np.hypot(*(known.xyz[:, :2] - known.towers[number].place).T)
    xyz = known.xyz[(near >= 2.0) & (near <= radius)]
    return WirePoints(xyz, np.ones(len(xyz), bool))


def cut_out(known: KnownLine, number: int, radius: float, off: float = 0.0) -> SurveyLine:
    """What is found of a tower in a survey that ends ``radius`` m from it."""
    tower = replace(known.towers[number], bearings=bearings(known, number, off))
    points = cut(known, number, radius)

    def seen(place: np.ndarray, reach: float) -> np.ndarray:
        return points.xyz[np.hypot(*(points.xyz[:, :2] - place).T) <= reach]

    return find_line(points, [tower], seen)


def distances(line: SurveyLine, known: KnownLine) -> list[float]:
    """m, of each conductor found from the nearest true one."""
    apart = []
    for found in line.conductors:
        places = found.catenary.at_shares(np.linspace(0.2, 0.8, 20))
        each = [np.median(np.hypot(*t.catenary.residuals(places))) for t in known.conductors]
        apart.append(float(min(each)))
    return apart


@pytest.mark.parametrize(("radius", "off"), [(14.0, 0.0), (18.0, 8.0), (18.0, -8.0)])
def test_short_wires_of_a_tower_are_conductors_of_two_spans(pylons, radius, off):
    line = cut_out(pylons, 2, radius, off)
    number = pylons.towers[2].id
    assert len(line.spans) == 2
    assert all(number in (span.from_tower, span.to_tower) for span in line.spans)
    assert sum(span.conductors + span.earth_wires for span in line.spans) == 14
    assert max(distances(line, pylons)) < 0.1


def test_what_leaves_a_tower_in_another_direction_is_no_span(pylons):
    line = cut_out(pylons, 2, 14.0, off=45.0)
    assert all(distance < 0.1 for distance in distances(line, pylons))
    assert len(line.conductors) <= 14


def test_where_the_survey_goes_on_wires_do_not_end_beside_a_tower(pylons):
    points, tower = cut(pylons, 2, 14.0), replace(pylons.towers[2], bearings=bearings(pylons, 2))
    free = np.ones(len(points), bool)
    assert not list(edge_spans(points, free, [tower], [], pylons.to_its_ends))
    assert list(edge_spans(points, free, [tower], [], lambda place, radius: points.xyz[:0]))


def test_a_member_as_long_as_a_crossarm_is_no_wire(pylons):
    """Points of two members of 5 m, in the direction of the line."""
    tower: LineTower = replace(pylons.towers[2], bearings=bearings(pylons, 2))
    way = np.array([np.sin(np.radians(tower.bearings[0])), np.cos(np.radians(tower.bearings[0]))])
    s = np.linspace(1.0, 6.0, 60)
    side = 3.0 * np.array([way[1], -way[0]])
    rows = [
        np.column_stack((tower.place + s[:, None] * way + across, np.full(len(s), tower.base + 20)))
        for across in (side, -side)
    ]
    xyz = np.concatenate(rows)
    line = find_line(WirePoints(xyz, np.ones(len(xyz), bool)), [tower], pylons.to_its_ends)
    assert not line.conductors


def test_longer_wires_are_found_as_without_the_bearings_of_their_tower(pylons):
    number, longer = 2, EDGE_M + 10.0
    known = cut_out(pylons, number, longer)
    tower = replace(pylons.towers[number], bearings=())
    other = find_line(cut(pylons, number, longer), [tower], pylons.to_its_ends)
    assert [c.catenary for c in known.conductors] == [c.catenary for c in other.conductors]
