"""A study in one table: mean and spread over seeds, the thesis' numbers beside."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from scenenet.experiments.published import Published, Thesis
from scenenet.experiments.studies.settings import StudySettings

if TYPE_CHECKING:
    import pandas as pd

SCORES = ("precision", "recall", "f05", "iou_tower", "miou")
PUBLISHED = ("precision", "recall", "miou")


def summarise(study: StudySettings, runs: pd.DataFrame, thesis: Thesis) -> pd.DataFrame:
    """One row per variant, in their order.

    Args:
        runs: of ``run_study``.

    Returns:
        variant, n_seeds; alive, how many of these, and live_share; mean and ``_std`` of each score
        over all seeds; mean of parameters, training_crops, training_seconds, inference_ms;
        negative_share of the seeds that end with a negative number, and the lowest of all;
        ``thesis_`` columns of what is published.
    """
    import pandas as pd

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
        for name in ("parameters", "training_crops", "training_seconds", "inference_ms"):
            row[name] = group[name].mean()
        lowest = group[["lowest_weight", "lowest_shape"]].min(axis=1).dropna()
        row["negative_share"] = (lowest < 0).mean() if len(lowest) else math.nan
        row |= {name: group[name].min() for name in ("lowest_weight", "lowest_shape")}
        for name in PUBLISHED:
            number = thesis.number(f"{variant.thesis}.{name}") or Published(place="")
            row |= {f"thesis_{name}": number.value, f"thesis_{name}_std": number.spread}
        rows.append(row)
    return pd.DataFrame(rows)
