"""The list of the towers of a survey, and what its page shows of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from scenenet.core.columns import FieldColumn
from scenenet.detection.survey_tower import TOWER_COLUMNS, SurveyTower
from scenenet.interpretability.doubts import doubt_rank
from scenenet.interpretability.explanations import TowerExplanation, explanations
from scenenet.prediction.page.markup import headings, row
from scenenet.prediction.page.pictures import TowerPicture, radius_of

if TYPE_CHECKING:
    from scenenet.prediction.survey_prediction import SurveyPrediction

DECIMALS = {"m": 2, "1": 3, "": 0}
"""Decimals of the values of a column, by its unit."""

LISTED = tuple(column for column in TOWER_COLUMNS if column.heading is not None)
"""The columns of the tower list that are for people."""

STATES = {"found": "found", "check": "to check"}
"""Class of a row -> what it says of a tower."""

Explained = tuple[SurveyTower, TowerExplanation]
"""A tower with its explanation."""


def to_check_first(prediction: SurveyPrediction) -> list[Explained]:
    """The towers of a survey, those with most reasons to check them first, the others as in its
    list."""
    notes = () if prediction.line is None else prediction.line.notes
    explained = explanations(
        prediction.towers, prediction.card, prediction.unit_sizes, prediction.unit_names, notes
    )
    both = zip(prediction.towers, explained, strict=True)
    return sorted(
        both,
        key=lambda one: doubt_rank(one[1].doubts, one[0].probability if one[1].doubts else 0.0),
    )


def tower_headings(planar: str, vertical: str) -> str:
    """The heading of the list.

    Args:
        planar, vertical: what follows a length in plan, and a height.
    """
    titles = []
    for column in LISTED:
        unit = f" [{vertical if column.vertical else planar}]" if column.unit == "m" else ""
        titles.append((f"{column.heading}{unit}", column.description, "number"))
    titles.insert(1, ("state", "to check: there is a reason to doubt it", "text"))
    return headings(titles)


def tower_rows(towers: Sequence[Explained]) -> str:
    """The rows of the list."""
    _, *others = LISTED
    rows = []
    for tower, one in towers:
        kind = "check" if one.doubts else "found"
        cells = [(_text(column, tower), "number") for column in others]
        rows.append(row("tower", tower.id, kind, STATES[kind], cells))
    return "\n".join(rows)


def _text(column: FieldColumn, tower: SurveyTower) -> str:
    return f"{column.value(tower):.{DECIMALS[column.unit]}f}"


def tower_data(towers: Sequence[Explained], vertical_m: float) -> list[dict[str, Any]]:
    """What the script of the page needs of each tower.

    Args:
        vertical_m: size in m of the unit of heights.
    """
    return [
        {
            "id": tower.id,
            "x": round(tower.x, 3),
            "y": round(tower.y, 3),
            "base_m": round(tower.base * vertical_m, 2),
            "height_m": round(tower.height * vertical_m, 2),
            "radius_m": round(radius_of(tower.height * vertical_m), 2),
            "bearings": [round(bearing, 1) for bearing in tower.conductor_bearings],
            "evidence": one.evidence,
            "shares": [(name, round(share, 3), text) for name, share, text in one.contributions],
            "doubts": one.doubts,
        }
        for tower, one in towers
    ]


def tower_picture(picture: TowerPicture) -> str:
    """The points of a tower, where the script of the page finds them."""
    return (
        f'<script type="text/plain" id="points-{picture.tower}" data-own="{picture.own}">'
        f"{picture.packed()}</script>"
    )
