"""Towers as the line shows them."""

from __future__ import annotations

from dataclasses import replace

import pytest
from fixtures.line_scene import PYLONS, known_line

from scenenet.line.find_line import find_line
from scenenet.line.records import SurveyLine

LEVELS = {"lattice": "2+2+2", "window": "6", "wooden": "1+2", "h_frame": "3"}


@pytest.mark.parametrize("kind", LEVELS)
def test_conductors_are_counted_by_the_crossarms_of_the_tower(kind):
    pylons = PYLONS if kind in ("lattice", "window") else {}
    known = known_line(**{**pylons, "kinds": {kind: 1.0}, "towers": 3})
    wide = [replace(tower, width=0.4 if kind == "wooden" else 3.0) for tower in known.towers]
    line = find_line(known.points, wide, known.to_its_ends)
    assert [support.tower for support in line.supports] == [tower.id for tower in wide]
    for support, tower in zip(line.supports, wide, strict=True):
        assert support.levels == LEVELS[kind]
        assert support.line == 1 and support.spans >= 2
        assert support.body == ("pole" if kind == "wooden" else "lattice")
        held = [c.catenary.start[2] - tower.base for c in known.conductors
                if c.from_tower == tower.id and not c.is_earth_wire]  # fmt: skip
        # At the ends of the survey the direction of the crossarms is not known.
        assert support.highest == pytest.approx(max(held), abs=0.6)
        assert support.lowest == pytest.approx(min(held), abs=0.6)
    assert SurveyLine.from_json(line.to_json()) == line


def test_a_tower_of_no_line_and_one_of_unknown_width_are_not_described_by_guess():
    known = known_line(towers=3)
    lone = replace(known.towers[0], id=99, y=known.towers[0].y + 300.0)
    line = find_line(known.points, [*known.towers, lone], known.to_its_ends)
    assert [support.tower for support in line.supports] == [tower.id for tower in known.towers]
    assert {support.body for support in line.supports} == {""}
