"""The scores that every table reports, each declared once (thesis 5.2.4.1).

Tables, studies, cross-validation, label noise, MLflow runs, the report and the command line take
their columns from here. A score that is added to ``SCORE_COLUMNS`` and to ``ScoreFields`` appears
in all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

BETA = 0.5
"""Weight of recall in F_beta: precision counts twice as much as recall (thesis 5.2.4.1)."""


class Counts(Protocol):
    """Numbers of voxels, predicted against labelled: true and false positives and negatives."""

    @property
    def tp(self) -> int: ...
    @property
    def fp(self) -> int: ...
    @property
    def fn(self) -> int: ...
    @property
    def tn(self) -> int: ...


def ratio(part: float, whole: float) -> float | None:
    """``part / whole``; None, which means not defined, if ``whole`` is 0."""
    return part / whole if whole else None


def precision(counts: Counts) -> float | None:
    """Share of the detected voxels that are labelled. None if nothing is labelled or detected.

    0 if something is labelled and nothing is detected: the thesis counts a dead model with 0 in its
    means over seeds (5.2.6), and without it a model that detects nothing would raise them.
    """
    if counts.fn and not counts.tp + counts.fp:
        return 0.0
    return ratio(counts.tp, counts.tp + counts.fp)


def recall(counts: Counts) -> float | None:
    """Share of the labelled voxels that are detected. None if nothing is labelled."""
    return ratio(counts.tp, counts.tp + counts.fn)


def f05(counts: Counts) -> float | None:
    """F_beta = (1 + beta^2) P R / (beta^2 P + R), beta = 0.5. None if nothing is labelled or
    detected; 0 if nothing is labelled and something is detected."""
    b2 = BETA**2
    return ratio((1 + b2) * counts.tp, (1 + b2) * counts.tp + b2 * counts.fn + counts.fp)


def iou_tower(counts: Counts) -> float | None:
    """None if nothing is labelled or detected."""
    return ratio(counts.tp, counts.tp + counts.fp + counts.fn)


def iou_background(counts: Counts) -> float | None:
    """None if every voxel is labelled and detected."""
    return ratio(counts.tn, counts.tn + counts.fp + counts.fn)


def miou(counts: Counts) -> float | None:
    """Mean over {background, tower}: the thesis' "IoU". None if one of the two is not defined.

    Predicting nothing scores about 0.5.
    """
    tower, background = iou_tower(counts), iou_background(counts)
    return None if tower is None or background is None else (tower + background) / 2


def or_nan(value: float | None) -> float:
    """A score for a table of numbers, in which NaN means not defined."""
    return math.nan if value is None else value


def score_text(value: float | None, decimals: int = 2) -> str:
    """A score in a sentence."""
    return "not defined" if value is None or value != value else f"{value:.{decimals}f}"


@dataclass(frozen=True)
class ScoreColumn:
    """One score of the tower class.

    Attributes:
        name: column in CSV files, key in JSON files, and metric in MLflow.
        label: column title in the report.
        short: column title where space is scarce.
        description: what the score is, as a phrase.
        compute: the score of the counts of all voxels of all samples; None if it is not defined.
        unit: ``1`` for a share between 0 and 1.
        tower_only: whether the score depends on the tower class alone. Tables that compare two
            ways to count leave the others out, because background fills nearly all voxels.
        published: whether the thesis reports it for its models and ablations (Table 5.3).
    """

    name: str
    label: str
    short: str
    description: str
    compute: Callable[[Counts], float | None]
    unit: str = "1"
    tower_only: bool = True
    published: bool = False


SCORE_COLUMNS = (
    ScoreColumn(
        "precision",
        "precision",
        "P",
        "share of the voxels predicted as tower that are labelled tower",
        precision,
        published=True,
    ),
    ScoreColumn(
        "recall",
        "recall",
        "R",
        "share of the voxels labelled tower that are predicted as tower",
        recall,
        published=True,
    ),
    ScoreColumn(
        "f05",
        "F0.5",
        "F0.5",
        "weighted harmonic mean of precision and recall; precision counts twice as much",
        f05,
    ),
    ScoreColumn(
        "iou_tower",
        "tower IoU",
        "IoU",
        "intersection over union of predicted and labelled tower voxels",
        iou_tower,
    ),
    ScoreColumn(
        "miou",
        "mean IoU",
        "mIoU",
        "mean of the IoU of towers and the IoU of background, the IoU of the thesis",
        miou,
        tower_only=False,
        published=True,
    ),
)
"""Every score, in the order of the tables."""


@dataclass(frozen=True)
class ScoreFields:
    """The value of each score of ``SCORE_COLUMNS``, in this order; None if it is not defined."""

    precision: float | None
    recall: float | None
    f05: float | None
    iou_tower: float | None
    miou: float | None


SCORES = tuple(column.name for column in SCORE_COLUMNS)
TOWER_ONLY_SCORES = tuple(column.name for column in SCORE_COLUMNS if column.tower_only)
PUBLISHED_SCORES = tuple(column.name for column in SCORE_COLUMNS if column.published)

DECISIVE = "f05"
"""The score by which tau and the best seed are chosen (thesis 5.2.7); MLflow plots it first."""
DECISIVE_FIRST = (DECISIVE, *(name for name in SCORES if name != DECISIVE))

CHART_SCORES = tuple(c for c in SCORE_COLUMNS if c.name in ("precision", "recall", "f05"))
"""The scores in charts of many models, where all of them would not fit."""


def score_column(name: str) -> ScoreColumn:
    """The score called ``name``.

    Raises:
        KeyError: there is no such score.
    """
    return {column.name: column for column in SCORE_COLUMNS}[name]


@dataclass(frozen=True)
class MatchColumn:
    """One number of the comparison of predicted with labelled or true towers or points.

    Attributes:
        name: column in CSV files, key in JSON files, and metric in MLflow.
        label: column title in the report, with the unit.
        unit: ``1`` for shares and counts.
        kind: how the report writes it.
    """

    name: str
    label: str
    unit: str
    kind: Literal["score2", "metres", "count", "number"]


MATCH_COLUMNS = (
    MatchColumn("precision", "precision", "1", "score2"),
    MatchColumn("recall", "recall", "1", "score2"),
    MatchColumn("median_error_m", "median position error [m]", "m", "metres"),
    MatchColumn("median_height_error_m", "median height error [m]", "m", "metres"),
    MatchColumn("median_base_error_m", "median base error [m]", "m", "metres"),
    MatchColumn("n_true", "labelled towers", "1", "count"),
    MatchColumn("n_predicted", "predicted towers", "1", "number"),
)
"""``scenenet.metrics.tower_matching.TowerMatch.scores``, in the order of the tables."""

MATCH_SCORES = tuple(column.name for column in MATCH_COLUMNS)

POINT_COLUMNS = (
    MatchColumn("precision", "precision", "1", "score2"),
    MatchColumn("recall", "recall", "1", "score2"),
    MatchColumn("iou", "IoU", "1", "score2"),
    MatchColumn("n_true", "tower points", "1", "count"),
    MatchColumn("n_predicted", "points with a tower id", "1", "number"),
)
"""``scenenet.evaluation.result.PointScores``: points with a tower id against tower points."""

POINT_SCORES = tuple(column.name for column in POINT_COLUMNS)

TRUTH = "truth_"
"""Beginning of the columns with scores against the truth; the others are against the labels."""

AT_TAU = "at or above tau"
"""Voxels count as detected if their probability is at or above tau, as in the thesis."""
WHOLE_TOWERS = "whole towers"
"""Voxels count as detected if they belong to a tower that was found, its whole body included
(``scenenet.evaluation.crop_towers.find_in_crop``)."""
VOXELS = (AT_TAU, WHOLE_TOWERS)
"""The values of the column ``voxels``: which voxels of a model count as detected."""
