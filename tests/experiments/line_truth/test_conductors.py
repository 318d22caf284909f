"""Found conductors against true ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fixtures.line_scene import PYLONS, known_line
from fixtures.sound_tower import SOUND_TOWER

from scenenet.detection.survey_tower import SurveyTower
from scenenet.experiments.line_truth.conductors import compare, table
from scenenet.line.find_line import find_line
from scenenet.synthetic.corridor import Corridor
from scenenet.synthetic.settings import SyntheticSettings

SETTINGS = {**PYLONS, "towers": 4, "seed": 4, "section": 0}


def listed(corridor: Corridor) -> list[SurveyTower]:
    """The true towers, as a list has them, with their true numbers as ids."""
    return [
        replace(
            SOUND_TOWER, id=tower.id, x=tower.x, y=tower.y, height=tower.height, base=tower.base
        )
        for tower in corridor.towers
    ]


@pytest.fixture(scope="module")
def corridor() -> Corridor:
    return Corridor(SyntheticSettings(**SETTINGS))


@pytest.fixture(scope="module")
def line():
    known = known_line(**{name: value for name, value in SETTINGS.items() if name != "seed"})
    return find_line(known.points, known.towers, known.to_its_ends)


def test_a_line_that_is_found_has_no_errors(corridor, line):
    found = compare("lattice", corridor, listed(corridor), line)
    assert found.towers == (4, 4, 4)
    assert (found.found, found.true, found.false) == (21, 21, 0)
    assert (found.ordered, found.spans) == (3, 3)
    assert np.median(found.sag) < 0.05 and np.median(found.attachment) < 0.2
    assert "| lattice | 4 of 4, 0 | 21 of 21 | 0 |" in table([found])[2]


def test_a_missed_and_an_invented_conductor_are_counted(corridor, line):
    first, *others = [c for c in line.conductors if c.from_tower and c.to_tower]
    (x, y, z), (far_x, far_y, far_z) = first.catenary.start, first.catenary.end
    moved = replace(first.catenary, start=(x, y, z + 2.0), end=(far_x, far_y, far_z + 2.0))
    changed = replace(line, conductors=(replace(first, catenary=moved), *others))
    found = compare("lattice", corridor, listed(corridor), changed)
    assert (found.found, found.true, found.false) == (20, 21, 1)


def test_a_tower_that_is_missed_breaks_the_order(corridor, line):
    found = compare("lattice", corridor, listed(corridor)[1:], line)
    assert found.towers == (3, 3, 4)
    assert found.ordered < 3


def test_nothing_found_is_nothing(corridor, line):
    nothing = replace(line, spans=(), conductors=(), notes=())
    found = compare("lattice", corridor, [], nothing)
    assert (found.found, found.false, found.ordered) == (0, 0, 0)
    assert "nan" in table([found])[2]
