"""Table of the cross-validation: means over folds, their spread over seeds, and pooled counts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from scenenet.metrics.score_columns import (
    AT_TAU,
    DECISIVE,
    SCORES,
    TRUTH,
    score_column,
    score_text,
)
from scenenet.metrics.voxel_scores import Confusion

COUNTS = ("tp", "fp", "fn", "tn")

CASE = ("model", "voxels")
"""Columns that identify a row of the table: a model, and which of its voxels count as detected."""


def summarise_folds(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per model and way to count, in the order of ``runs``.

    Args:
        runs: of ``scenenet.experiments.cross_validation.run``.

    Returns:
        model, voxels, n_seeds, n_folds, crops; live_share of the trainings; each score as the mean
        over folds and seeds, and its spread ``_std``: the standard deviation over seeds of the mean
        over folds; ``pooled_`` scores of the counts of all folds together, mean over seeds, with
        their ``_std``; worst_fold_f05, best_fold_f05: means over seeds; parameters. Scores against
        the truth, where it is known, have names that begin with ``TRUTH`` and come first.
    """
    rows = []
    for (model, voxels), group in runs.groupby(list(CASE), sort=False):
        row: dict[str, Any] = {
            "model": model,
            "voxels": voxels,
            "n_seeds": group["seed"].nunique(),
            "n_folds": group["fold"].nunique(),
            "crops": sum(len(crops.split()) for crops in group.groupby("fold")["crops"].first()),
            "live_share": group["alive"].astype(float).mean(),
        }
        for against in (TRUTH, ""):
            row |= {f"{against}{name}": value for name, value in _scores(group, against).items()}
        row["parameters"] = group["parameters"].mean()
        rows.append(row)
    return pd.DataFrame(rows)


def _scores(group: pd.DataFrame, against: str) -> dict[str, float]:
    """The scores of a row of the table against the truth or against the labels.

    Args:
        group: the runs of the row.
        against: beginning of the names of their columns.
    """
    row: dict[str, float] = {}
    names = [f"{against}{name}" for name in (*SCORES, *COUNTS)]
    runs = group[["seed", "fold"]].assign(
        **{name: group[column].astype(float) for name, column in
           zip((*SCORES, *COUNTS), names, strict=True)}
    )  # fmt: skip
    by_seed = runs.groupby("seed")
    for name in SCORES:
        means = by_seed[name].mean()
        row |= {name: means.mean(), f"{name}_std": means.std()}
    pooled = pd.DataFrame(
        [Confusion(*counts).scores() for counts in by_seed[list(COUNTS)].sum().to_numpy()],
        columns=list(SCORES),
        dtype=float,
    )
    for name in SCORES:
        row |= {f"pooled_{name}": pooled[name].mean(), f"pooled_{name}_std": pooled[name].std()}
    of_folds = runs.groupby("fold")["f05"].mean()
    return row | {"worst_fold_f05": of_folds.min(), "best_fold_f05": of_folds.max()}


def leading(table: pd.DataFrame) -> str:
    """Beginning of the columns to lead with: ``TRUTH`` where it is known, else an empty one.

    Args:
        table: of ``summarise_folds``, or of the runs.
    """
    return TRUTH if table[f"{TRUTH}{DECISIVE}"].notna().any() else ""


def case_name(model: str, voxels: str) -> str:
    """The name of a row in text and figures: the model, with the way to count if not at tau."""
    return model if voxels == AT_TAU else f"{model}, {voxels}"


def ranking(table: pd.DataFrame, models: Mapping[str, str]) -> str:
    """A sentence with the score of every row, best first.

    Args:
        table: of ``summarise_folds``.
        models: name -> architecture; not used, as the ranking treats all models alike.
    """
    start = leading(table)
    column, against = f"{start}{DECISIVE}", " against the truth" if start else ""
    ranked = table.sort_values(column, ascending=False)
    scores = [
        f"{case_name(row['model'], row['voxels'])} {score_text(row[column], 3)}"
        for row in ranked.to_dict("records")
    ]
    return (
        f"{score_column(DECISIVE).label} of the tower class{against}, best first: "
        f"{', '.join(scores)}."
    )
