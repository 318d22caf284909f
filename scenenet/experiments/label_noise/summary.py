"""Table of the label noise experiment, and a test of the claim of thesis 5.2.5."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from scenenet.experiments.label_noise.settings import AGAINST, LABELS
from scenenet.metrics.score_columns import TOWER_ONLY_SCORES, score_text

MEASURED = (
    *(f"{against}_{score}" for against in AGAINST for score in TOWER_ONLY_SCORES),
    "wrong_detected",
)


def summarise_label_noise(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per level of noise and model, in their order; the labels are first at each level.

    Args:
        runs: of ``scenenet.experiments.label_noise.run``, all seeds.

    Returns:
        level, model, n_seeds, live_share; share, share_low, share_high: mislabelled tower points,
        mean and bounds over the lines; strength; mean and ``_std`` over the seeds of each score
        against the labels and against the truth, and of ``wrong_detected``; gain, gain_std: F0.5 of
        a model against the truth, minus F0.5 of the labels of the same line; better_seeds: number
        of seeds with a positive gain; parameters.
    """
    own = runs[runs["model"] == LABELS].set_index(["level", "seed"])["truth_f05"]
    rows = []
    for (level, model), group in runs.groupby(["level", "model"], sort=False):
        row: dict[str, Any] = {
            "level": level,
            "model": model,
            "n_seeds": len(group),
            "live_share": group["alive"].astype(float).mean(),
            "share": group["share"].mean(),
            "share_low": group["share"].min(),
            "share_high": group["share"].max(),
            "strength": group["strength"].mean(),
        }
        for name in MEASURED:
            row |= {name: group[name].mean(), f"{name}_std": group[name].std()}
        if model != LABELS:
            gain = group.set_index(["level", "seed"])["truth_f05"] - own
            gain = gain.dropna()
            row |= {"gain": gain.mean(), "gain_std": gain.std()}
            row["better_seeds"] = int((gain > 0).sum())
        row["parameters"] = group["parameters"].mean()
        rows.append(row)
    table = pd.DataFrame(rows).astype({"better_seeds": "Int64"})
    return table.sort_values("level", kind="stable", ignore_index=True)


HALF = 0.5
"""Smallest share of wrong tower points for which the claim is tested; the thesis says "more than
50%"."""


def claim(table: pd.DataFrame, models: Mapping[str, str]) -> str:
    """Whether the results of SCENE-Net agree with thesis 5.2.5, in sentences that follow a rule.

    A model is nearer to the truth than its labels in a seed if its F0.5 against the truth is higher
    than that of the labels. It ignores the wrong labels if it detects a smaller share of the wrong
    tower voxels than of the true ones. The rule uses the levels with half of the tower points wrong
    or more, or else the highest level.

    Args:
        table: of ``summarise_label_noise``.
        models: name -> architecture.
    """
    noisy = table[table["level"] > 0]
    much = noisy[noisy["level"] >= min(HALF, noisy["level"].max())] if len(noisy) else noisy
    nets = [name for name in much["model"].unique() if models.get(name) == "scenenet"]
    if not nets:
        return "No SCENE-Net was trained on wrong labels in this run, so the claim is not tested."
    labels = _mean(much[much["model"] == LABELS], "truth_f05")
    verdicts = []
    for name in nets:
        own = much[much["model"] == name]
        n, better = int(own["n_seeds"].sum()), int(own["better_seeds"].sum())
        wrong, true = _mean(own, "wrong_detected"), _mean(own, "truth_recall")
        how = {n: "all", 0: "none"}.get(better, f"{better}")
        ignores = "It ignores" if wrong < true else "It does not ignore"
        verdicts.append(
            f"{name} is nearer to the truth than its labels in {how} of {n} trainings (F0.5 "
            f"{_mean(own, 'truth_f05'):.2f}). {ignores} the wrong labels: it detects {wrong:.0%} "
            f"of "
            f"the wrong tower voxels and {true:.0%} of the true ones."
        )
    return (
        f"With {much['share'].mean():.0%} of the tower points mislabelled, the labels have an F0.5 "
        f"of {score_text(labels)} against the truth. {' '.join(verdicts)}"
    )


def findings(table: pd.DataFrame) -> list[str]:
    """The scores of the labels and of each model over the levels of noise, a sentence each.

    Args:
        table: of ``summarise_label_noise``.
    """
    noisy = table[table["level"] > 0]
    labels = noisy[noisy["model"] == LABELS]
    sentences = [
        f"{LABELS}: F0.5 {_listed(labels['truth_f05'])} against the truth, with "
        f"{_shares(labels)} of "
        "the tower points wrong"
    ]
    for model, own in noisy[noisy["model"] != LABELS].groupby("model", sort=False):
        better = ", ".join(f"{row.better_seeds} of {row.n_seeds}" for row in own.itertuples())
        sentences.append(
            f"{model}: F0.5 {_listed(own['truth_f05'])} against the truth, with {_shares(own)} of "
            f"the tower points wrong; higher than the labels in {better} seeds. Share of the wrong "
            f"tower voxels that it detects: {_listed(own['wrong_detected'])}; of the true ones: "
            f"{_listed(own['truth_recall'])}"
        )
    return sentences


def _mean(rows: pd.DataFrame, column: str) -> float:
    return float(rows[column].mean())


def _listed(values: pd.Series) -> str:
    return ", ".join(score_text(value) for value in values)


def _shares(rows: pd.DataFrame) -> str:
    return ", ".join(f"{share:.0%}" for share in rows["share"])
