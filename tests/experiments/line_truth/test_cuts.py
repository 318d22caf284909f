"""Conductors that are found in cuts around single towers, against true ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fixtures.line_scene import PYLONS
from fixtures.true_line import true_line

from scenenet.experiments.line_truth.cuts import Comparison, around, compare, run, table
from scenenet.experiments.line_truth.lines import line_of
from scenenet.models.packaged import WIRES, packaged_model
from scenenet.pointcloud import PointCloud
from scenenet.synthetic.corridor import Corridor
from scenenet.synthetic.settings import SyntheticSettings

RADIUS = 15.0


@pytest.fixture(scope="module")
def corridor() -> Corridor:
    return Corridor(SyntheticSettings(**PYLONS, towers=3, seed=4, section=0))


def in_cut(corridor: Corridor):
    """The true conductors of the middle tower, as far as the cut around it reaches, as found."""
    middle = corridor.towers[1]
    own = [c for c in corridor.conductors if middle.id in (c.from_tower, c.to_tower)]
    line = true_line(own)
    wires = []
    for true, wire in zip(own, line.conductors, strict=True):
        reach = (0, RADIUS) if true.from_tower == middle.id else (wire.length - RADIUS, wire.length)
        curve = wire.catenary.between(*reach)
        wires.append(replace(wire, catenary=curve, length=curve.length))
    return middle, replace(line, conductors=tuple(wires))


def test_conductors_that_end_with_the_cut_are_found(corridor):
    middle, line = in_cut(corridor)
    number = len(line.conductors)
    assert number == 14
    assert compare(corridor.conductors, middle, RADIUS, line) == (number, number, 0, 0)


def test_missed_and_invented_conductors_and_cables_are_counted(corridor):
    middle, line = in_cut(corridor)
    first, second, *others = line.conductors
    (x, y, z), (far_x, far_y, far_z) = first.catenary.start, first.catenary.end
    moved = replace(first.catenary, start=(x, y, z + 2.0), end=(far_x, far_y, far_z + 2.0))
    cable = replace(second, kind="cable")
    changed = replace(line, conductors=(replace(first, catenary=moved), cable, *others))
    number = len(line.conductors)
    assert compare(corridor.conductors, middle, RADIUS, changed) == (number - 2, number, 1, 1)


def test_a_cut_ends_at_its_radius(corridor):
    tower = corridor.towers[0]
    xyz = np.array([[0.0, 14.9, 3.0], [10.0, 11.2, 3.0], [0.0, 0.0, 90.0]])
    cloud = PointCloud(xyz + np.array([tower.x, tower.y, 0.0]), np.arange(3, dtype=np.uint8))
    assert around(cloud, tower, RADIUS).classification.tolist() == [0, 2]


def test_cuts_of_a_survey_are_predicted(tmp_path):
    found = run(line_of("tubular", 2, 104, density=25.0), packaged_model(WIRES), RADIUS, tmp_path)
    assert (found.cuts, found.with_tower) == (2, 2)
    # Three conductors on each side of each pole.
    assert found.true == 12
    assert found.found >= 9 and found.false == 0


def test_the_table_has_a_row_for_each_kind():
    *_, row = table([Comparison("window", 5, 4, 60, 70, 1, 2)])
    assert row == "| window | 4 of 5 | 60 of 70 | 1 | 2 |"
