"""Found clearances and trees against true ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fixtures.true_line import true_line, wire_of

from scenenet.clearance.find_clearances import find_clearances
from scenenet.clearance.section import SectionPoints
from scenenet.clearance.settings import ClearanceSettings
from scenenet.experiments.line_truth.clearances import STANDING, compare, table
from scenenet.line.records import SurveyLine
from scenenet.pointcloud import PointCloud
from scenenet.synthetic.codes import TALL, TOWER
from scenenet.synthetic.corridor import Corridor
from scenenet.synthetic.settings import SyntheticSettings

LIMITS = ClearanceSettings(voltage=66.0)


@pytest.fixture(scope="module")
def survey():
    """Four poles in a wood: the corridor, its points with true classes, its line, and what is found
    around its true conductors by height above ground."""
    corridor = Corridor(
        SyntheticSettings(towers=4, seed=7, kinds={"lattice_pole": 1.0}, density=20, section=0)
    )
    parts = list(corridor)
    xyz, codes = (np.concatenate([getattr(p, name) for p in parts]) for name in ("xyz", "truth"))
    standing = xyz[codes != TOWER]

    def points(area):
        inside = area.has(standing)
        return SectionPoints(standing[inside])

    line = true_line(corridor.conductors)
    return corridor, PointCloud(xyz, codes), line, find_clearances(line, points, LIMITS)


def test_what_is_found_around_true_conductors_is_true(survey):
    corridor, *_ = survey
    found = compare("lattice_pole", *survey, LIMITS)
    between = [c for c in corridor.conductors if c.from_tower and c.to_tower]
    assert (len(found.vegetation), found.unseen) == (len(between), 0)
    assert np.median(found.vegetation) < 0.05
    assert found.danger_points > 100 and found.places > 0
    assert (found.missed, found.false) == (0, 0)
    assert found.trees > 3 and found.trees_missed < found.trees / 2
    assert f"{found.places} of {found.places} | 0" in table([found])[2]


def test_what_is_not_found_is_missed(survey):
    corridor, cloud, line, clearances = survey
    nothing = replace(clearances, places=(), trees=())
    found = compare("lattice_pole", corridor, cloud, line, nothing, LIMITS)
    assert found.missed == found.places > 0
    assert found.trees_missed == found.trees > 0
    assert found.unseen > 0 and len(found.vegetation) == 0
    assert "nan" in table([found])[2]


def test_a_place_that_is_listed_with_its_neighbour_is_found(survey):
    corridor, cloud, line, clearances = survey
    first = {place.span_id: place for place in reversed(clearances.dangers)}
    joined = replace(clearances, places=tuple(first.values()))
    found = compare("lattice_pole", corridor, cloud, line, joined, LIMITS)
    assert found.places > len(first) and found.missed == 0
    unseen = compare("lattice_pole", corridor, cloud, line, replace(joined, profile=()), LIMITS)
    assert unseen.missed > 0


def test_a_cable_that_keeps_its_own_limit_is_not_missed(survey):
    corridor, cloud, line, clearances = survey
    cables = [replace(place, kind="wire", what="nearest") for place in clearances.dangers]
    listed = replace(clearances, places=tuple(cables), profile=())
    found = compare("lattice_pole", corridor, cloud, line, listed, LIMITS)
    assert found.places > 0 and (found.missed, found.false) == (0, 0)


def test_points_of_a_cable_that_was_found_are_no_plants(survey):
    corridor, cloud, line, clearances = survey
    first = line.conductors[len(line.conductors) // 2]
    (x, y, z), (far_x, far_y, far_z) = first.catenary.start, first.catenary.end
    curve = replace(first.catenary, start=(x, y, z + 3.0), end=(far_x, far_y, far_z + 3.0))
    cable = wire_of(curve, 99, 1, "cable")
    points = curve.at_shares(np.linspace(0.4, 0.6, 30))
    xyz = np.concatenate([cloud.xyz, points])
    more = PointCloud(xyz, np.append(cloud.classification, np.full(30, TALL, np.uint8)))
    known = replace(line, conductors=(*line.conductors, cable))

    def near(cloud: PointCloud, line: SurveyLine) -> int:
        return compare("lattice_pole", corridor, cloud, line, clearances, LIMITS).danger_points

    assert near(more, line) == near(cloud, line) + 30
    assert near(more, known) == near(cloud, line)


def test_what_is_found_and_not_there_is_false(survey):
    corridor, cloud, line, clearances = survey
    moved = [replace(place, x=place.x + 500.0) for place in clearances.dangers if place.points >= 5]
    trees = [replace(tree, x=tree.x + 500.0) for tree in clearances.trees]
    wrong = replace(clearances, places=tuple(moved), trees=tuple(trees))
    found = compare("lattice_pole", corridor, cloud, line, wrong, LIMITS)
    assert found.false == sum(place.kind == "vegetation" for place in moved)
    assert found.trees_false == len(trees)


def test_true_trees_are_as_high_as_the_points_of_plants_there(survey):
    corridor, cloud, *_ = survey
    plants = cloud.xyz[np.isin(cloud.classification, STANDING)]
    seen = []
    for tree in corridor.trees:
        near = np.hypot(plants[:, 0] - tree.x, plants[:, 1] - tree.y) < tree.radius / 2
        if near.sum() >= 10:
            seen.append((plants[near, 2].max() - tree.base) / tree.height)
    assert len(seen) > 20
    assert 0.9 < np.median(seen) < 1.1
