"""Which towers come first in a review, and the reasons."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from fixtures.sound_tower import SOUND_TOWER

from scenenet.core.errors import InputError
from scenenet.detection.survey_tower import SurveyTower, row_types
from scenenet.review.doubts import by_doubt
from scenenet.review.found_list import FoundList, ListedTower

FOOT = 0.3048


def listed(*towers: SurveyTower, unit: float = 1.0) -> FoundList:
    """A list of towers, in units of this size in m."""
    sizes = (unit, unit, unit)
    names = ("metre",) * 3 if unit == 1.0 else ("foot",) * 3
    rows = [tower.in_units(sizes).to_row() for tower in towers]
    return FoundList(
        Path("a.towers.csv"), "a", row_types(["cylinder"]),
        tuple(ListedTower(row["id"], row["x"], row["y"], row) for row in rows),
        unit_sizes=sizes, unit_names=names, tau=0.6,
    )  # fmt: skip


def line(*changed: dict) -> list[SurveyTower]:
    """Seven towers 100 m apart, the first ones changed."""
    towers = [replace(SOUND_TOWER, id=n + 1, y=100.0 * n) for n in range(7)]
    for number, values in enumerate(changed):
        towers[number] = replace(towers[number], **values)
    return towers


@pytest.mark.parametrize("unit", [1.0, FOOT])
def test_the_tower_with_most_reasons_comes_first(unit):
    towers = line({}, {"probability": 0.5}, {"height": 40.0, "points": 30})
    doubted = by_doubt(listed(*towers, unit=unit))
    assert [each.tower.id for each in doubted[:2]] == [3, 2]
    assert [len(each.reasons) for each in doubted] == [2, 1, 0, 0, 0, 0, 0]
    few, unusual = doubted[0].reasons
    assert "30 points of its own" in few
    shown = "40 m" if unit == 1.0 else "131 ft"
    assert f"it is {shown} tall, and half of the towers of the survey are lower" in unusual
    assert "below tau" in doubted[1].reasons[0]


def test_a_height_is_only_unusual_among_several_and_beyond_their_spread():
    few = line({"height": 40.0})[:4]
    assert not any(each.reasons for each in by_doubt(listed(*few)))
    mixed = line({"height": 12.0}, {"height": 34.0}, {"height": 11.0}, {"height": 33.0})
    assert not any(each.reasons for each in by_doubt(listed(*mixed)))


def test_towers_beside_each_other_name_each_other():
    first, second, *_ = by_doubt(listed(*line({}, {"y": 4.0})))
    assert {first.tower.id, second.tower.id} == {1, 2}
    assert f"4.0 m beside tower {second.tower.id}" in first.reasons[0]


def test_a_list_without_the_measures_is_refused():
    found = listed(*line())
    bare = ListedTower(9, 0.0, 0.0, {"id": 9, "x": 0.0, "y": 0.0})
    with pytest.raises(InputError, match="tower 9 has no height"):
        by_doubt(replace(found, columns={"id": int, "x": float, "y": float}, towers=(bare,)))
