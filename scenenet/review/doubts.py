"""Which towers of a list a person should look at first, and why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from scenenet.core.errors import InputError
from scenenet.detection.survey_tower import CONTRIBUTION, TOWER_COLUMNS, SurveyTower
from scenenet.interpretability.doubts import doubt_rank, survey_doubts
from scenenet.review.found_list import FoundList, ListedTower


@dataclass(frozen=True)
class Doubted:
    """A tower, with the reasons to look at it.

    Attributes:
        tower: of the list.
        reasons: as sentences; none for a tower that nothing speaks against.
    """

    tower: ListedTower
    reasons: tuple[str, ...]


def by_doubt(found: FoundList) -> list[Doubted]:
    """The towers of a list, those with most reasons to look at them first, among these those with
    the lowest probability.

    Raises:
        InputError: the list lacks a column of the towers that ``scenenet predict`` writes.
    """
    towers = [_survey_tower(tower, found) for tower in found.towers]
    reasons = survey_doubts(towers, found.tau, found.unit_sizes, found.unit_names, found.notes)
    doubted = [Doubted(t, r) for t, r in zip(found.towers, reasons, strict=True)]
    return sorted(
        doubted, key=lambda each: doubt_rank(each.reasons, each.tower.values["probability"])
    )


def _survey_tower(tower: ListedTower, found: FoundList) -> SurveyTower:
    values: dict[str, Any] = {}
    for column in TOWER_COLUMNS:
        if column.name == "contributions":
            values[column.name] = {
                geneo: tower.values[f"{CONTRIBUTION}{geneo}"] for geneo in found.geneos
            }
            continue
        value = tower.values.get(column.name)
        if value is None:
            raise InputError(
                f"tower {tower.id} has no {column.name}",
                file=found.path,
                remedy="Name the list of a prediction by this version, or predict the survey again",
            )
        if column.type is tuple:
            value = tuple(float(part) for part in value.split())
        values[column.name] = value
    return SurveyTower(**values)
