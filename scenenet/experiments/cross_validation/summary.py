"""Table of the cross-validation: means over folds, their spread over seeds, and pooled counts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from scenenet.metrics.score_columns import AT_TAU, DECISIVE, SCORES, score_column, score_text
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
        their ``_std``; worst_fold_f05, best_fold_f05: means over seeds; parameters.
    """
    rows = []
    for (model, voxels), group in runs.groupby(list(CASE), sort=False):
        by_seed = group.groupby("seed")
        row: dict[str, Any] = {
            "model": model,
            "voxels": voxels,
            "n_seeds": group["seed"].nunique(),
            "n_folds": group["fold"].nunique(),
            "crops": sum(len(crops.split()) for crops in group.groupby("fold")["crops"].first()),
            "live_share": group["alive"].astype(float).mean(),
        }
        for name in SCORES:
            means = by_seed[name].mean()
            row |= {name: means.mean(), f"{name}_std": means.std()}
        pooled = pd.DataFrame(
            [Confusion(*counts).scores() for counts in by_seed[list(COUNTS)].sum().to_numpy()]
        )
        for name in SCORES:
            row |= {f"pooled_{name}": pooled[name].mean(), f"pooled_{name}_std": pooled[name].std()}
        of_folds = group.groupby("fold")["f05"].mean()
        row |= {"worst_fold_f05": of_folds.min(), "best_fold_f05": of_folds.max()}
        row["parameters"] = group["parameters"].mean()
        rows.append(row)
    return pd.DataFrame(rows)


def case_name(model: str, voxels: str) -> str:
    """The name of a row in text and figures: the model, with the way to count if not at tau."""
    return model if voxels == AT_TAU else f"{model}, {voxels}"


def ranking(table: pd.DataFrame, models: Mapping[str, str]) -> str:
    """A sentence with the score of every row, best first.

    Args:
        table: of ``summarise_folds``.
        models: name -> architecture; not used, as the ranking treats all models alike.
    """
    ranked = table.sort_values(DECISIVE, ascending=False)
    scores = [
        f"{case_name(row['model'], row['voxels'])} {score_text(row[DECISIVE], 3)}"
        for row in ranked.to_dict("records")
    ]
    return f"{score_column(DECISIVE).label} of the tower class, best first: {', '.join(scores)}."
