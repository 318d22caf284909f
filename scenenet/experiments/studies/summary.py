"""Table of a study: mean and spread over seeds, with the numbers of the thesis."""

from __future__ import annotations

import math

import pandas as pd

from scenenet.experiments.published import Published, Thesis
from scenenet.experiments.studies.settings import StudySettings
from scenenet.metrics.score_columns import PUBLISHED_SCORES, SCORES


def summarise(study: StudySettings, runs: pd.DataFrame, thesis: Thesis) -> pd.DataFrame:
    """One row per variant, in their order.

    Args:
        study: the variants and their places in the thesis.
        runs: of ``run_study``.
        thesis: published numbers.

    Returns:
        variant, n_seeds; alive (number of live models) and live_share; mean and ``_std`` of each
        score over all seeds; mean of parameters, training_crops and scored_crops; negative_share
        (seeds that end with a negative parameter); lowest_weight and lowest_shape over all seeds;
        ``thesis_`` columns with the published scores.
    """
    rows = []
    for variant in study.all_variants():
        group = runs[runs["variant"] == variant.name]
        row: dict[str, object] = {
            "variant": variant.name,
            "n_seeds": len(group),
            "alive": int(group["alive"].sum()),
            "live_share": group["alive"].mean(),
        }
        for name in SCORES:
            row |= {name: group[name].mean(), f"{name}_std": group[name].std()}
        for name in ("parameters", "training_crops", "scored_crops"):
            row[name] = group[name].mean()
        lowest = group[["lowest_weight", "lowest_shape"]].min(axis=1).dropna()
        row["negative_share"] = (lowest < 0).mean() if len(lowest) else math.nan
        row |= {name: group[name].min() for name in ("lowest_weight", "lowest_shape")}
        for name in PUBLISHED_SCORES:
            number = thesis.number(f"{variant.thesis}.{name}") or Published(place="")
            row |= {f"thesis_{name}": number.value, f"thesis_{name}_std": number.spread}
        rows.append(row)
    return pd.DataFrame(rows)
