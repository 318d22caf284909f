"""Cross-validation in one table: means over folds, their spread over seeds, and pooled counts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scenenet.metrics.voxel_scores import Confusion

if TYPE_CHECKING:
    import pandas as pd

SCORES = ("precision", "recall", "f05", "iou_tower", "miou")
COUNTS = ("tp", "fp", "fn", "tn")


def summarise_folds(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per model, in their order.

    Args:
        runs: of ``scenenet.experiments.cross_validation.run``.

    Returns:
        model, n_seeds, n_folds, crops; live_share of the trainings; each score as the mean over
        folds and seeds, ``_std`` its spread: the standard deviation over seeds of the mean over
        folds; ``pooled_`` scores of the counts of all folds together, mean over seeds, with their
        ``_std``; worst_fold_f05, best_fold_f05: means over seeds; parameters, training_seconds.
    """
    import pandas as pd

    rows = []
    for model, group in runs.groupby("model", sort=False):
        by_seed = group.groupby("seed")
        row: dict[str, Any] = {
            "model": model,
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
        for name in ("parameters", "training_seconds"):
            row[name] = group[name].mean()
        rows.append(row)
    return pd.DataFrame(rows)
