"""Which towers of a list a person should look at first, and why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.detection.survey_tower import CONTRIBUTION, TOWER_COLUMNS, SurveyTower
from scenenet.interpretability.explanations import doubts
from scenenet.line.records import UNHELD
from scenenet.pointcloud.units import SYMBOLS
from scenenet.review.found_list import FoundList, ListedTower

ENOUGH = 5
"""Number of towers from which a height can be unusual among them."""

UNUSUAL = 3.0
"""Median absolute deviations, scaled to standard deviations, beyond which a height is unusual."""

SCALE = 1.4826
"""Standard deviation of normal values with a median absolute deviation of 1."""

AS_USUAL = 0.3
"""Share of the median by which any height may differ: spans over valleys and roads need it."""

BESIDE_M = 10.0
"""m between two towers below which they may be one."""


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
    own = [list(doubts(t, found.tau, found.unit_sizes, found.unit_names)) for t in towers]
    others = (_unusual_heights(towers, found), _neighbours(towers, found), _without_line(found))
    for more in others:
        for reasons, reason in zip(own, more, strict=True):
            reasons += reason
    doubted = [Doubted(t, tuple(r)) for t, r in zip(found.towers, own, strict=True)]
    return sorted(doubted, key=lambda each: (-len(each.reasons), each.tower.values["probability"]))


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


def _unusual_heights(towers: list[SurveyTower], found: FoundList) -> list[list[str]]:
    """A reason for each tower that is much lower or taller than most of the survey."""
    heights = np.array([tower.height for tower in towers])
    if len(heights) < ENOUGH:
        return [[] for _ in towers]
    middle = float(np.median(heights))
    usual = max(UNUSUAL * SCALE * float(np.median(np.abs(heights - middle))), AS_USUAL * middle)
    unit = found.unit_names[2]
    symbol = SYMBOLS.get(unit, unit)
    return [
        [
            f"it is {height:.0f} {symbol} tall, and half of the towers of the survey are "
            f"{'taller' if height < middle else 'lower'} than {middle:.0f} {symbol}"
        ]
        if abs(height - middle) > usual
        else []
        for height in heights
    ]


def _without_line(found: FoundList) -> list[list[str]]:
    """A reason for each tower that no conductor leads to."""
    unheld = {note.tower for note in found.notes if note.what == UNHELD}
    reason = "no conductor that was traced leads to it"
    return [[reason] if tower.id in unheld else [] for tower in found.towers]


def _neighbours(towers: list[SurveyTower], found: FoundList) -> list[list[str]]:
    """A reason for each tower that stands close to another one."""
    from scipy.spatial import cKDTree

    if len(towers) < 2:
        return [[] for _ in towers]
    places = found.places * found.unit_sizes[0]
    apart, nearest = cKDTree(places).query(places, k=2)
    return [
        [f"it stands {distance:.1f} m beside tower {towers[other].id}: they may be one"]
        if distance < BESIDE_M
        else []
        for distance, other in zip(apart[:, 1], nearest[:, 1], strict=True)
    ]
