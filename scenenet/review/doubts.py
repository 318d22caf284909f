"""Which towers and conductors of a list a person should look at first, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.detection.survey_tower import CONTRIBUTION, TOWER_COLUMNS, SurveyTower
from scenenet.interpretability.doubts import doubt_rank, survey_doubts
from scenenet.pointcloud.units import SYMBOLS
from scenenet.prediction.page.span_facts import LITTLE, ROUGH_M
from scenenet.review.found_list import FoundList, ListedTower
from scenenet.review.listed_conductor import ListedConductor

FEW = 0.2
"""Share of the usual number of points per length below which a conductor has few: an earth wire,
which is thinner, has about half as many."""

UNLIKE = 0.5
"""Share of the usual catenary parameter of its span, of three wires or more, below which one is
slacker than the wires beside it; above its inverse it is tauter."""


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


def conductors_by_doubt(found: FoundList) -> list[tuple[ListedConductor, tuple[str, ...]]]:
    """The conductors of a list, each with the reasons to look at it as sentences; those with most
    reasons first, among these those furthest from their points. Rejected ones come last."""
    usual = _usual_density(found.conductors)
    by_span: dict[int, list[ListedConductor]] = {}
    for each in found.conductors:
        by_span.setdefault(each.span_id, []).append(each)
    doubted = [
        (each, () if each.rejected else _wire_doubts(each, by_span[each.span_id], usual, found))
        for each in found.conductors
    ]
    return sorted(doubted, key=lambda own: (own[0].rejected, -len(own[1]), -own[0].values["rmse"]))


def _usual_density(conductors: Sequence[ListedConductor]) -> float:
    """Points per length of most conductors; 0 without any."""
    densities = [_density(each) for each in conductors]
    return float(np.median(densities)) if densities else 0.0


def _density(conductor: ListedConductor) -> float:
    return float(conductor.values["points"] / conductor.values["length"])


def _wire_doubts(
    conductor: ListedConductor, span: Sequence[ListedConductor], usual: float, found: FoundList
) -> tuple[str, ...]:
    """Reasons to look at a conductor.

    Args:
        span: the conductors of its span.
        usual: points per length of most conductors.
    """
    values, size = conductor.values, found.unit_sizes[0]
    unit = SYMBOLS.get(found.unit_names[0], found.unit_names[0])
    reasons = []
    if values["rmse"] * size > ROUGH_M:
        reasons.append(f"its points are {values['rmse']:.2f} {unit} from its catenary (RMSE)")
    if values["seen"] < LITTLE:
        reasons.append(f"it has points on {100 * values['seen']:.0f} % of its length only")
    if _density(conductor) < FEW * usual:
        reasons.append(f"it has few points ({values['points']})")
    others = [each.values["c"] for each in span]
    middle = float(np.median(others))
    if len(others) > 2 and not UNLIKE * middle <= values["c"] <= middle / UNLIKE:
        reasons.append(
            f"its catenary parameter is {values['c']:.0f} {unit}, and {middle:.0f} {unit} is usual "
            "in its span"
        )
    return tuple(reasons)
