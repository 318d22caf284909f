"""The noise study in one table, and what it says about the claim of thesis 5.2.5."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from scenenet.experiments.label_noise.settings import AGAINST, LABELS, SCORES

if TYPE_CHECKING:
    import pandas as pd

MEASURED = (*(f"{against}_{score}" for against in AGAINST for score in SCORES), "wrong_detected")


def summarise_noise(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per level of noise and model, in their order; the labels come first at each level.

    Args:
        runs: of ``scenenet.experiments.label_noise.run``, all seeds.

    Returns:
        level, model, n_seeds, live_share; share, share_low, share_high: of wrong tower points, mean
        and bounds over the lines; strength; mean and ``_std`` over the seeds of each score against
        the labels and against the truth, and of ``wrong_detected``; gain, gain_std: how much more
        F0.5 against the truth a model has than the labels of the same line have; better_seeds: in
        how many it is more; parameters, training_seconds.
    """
    import pandas as pd

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
        for name in ("parameters", "training_seconds"):
            row[name] = group[name].mean()
        rows.append(row)
    table = pd.DataFrame(rows).astype({"better_seeds": "Int64"})
    return table.sort_values("level", kind="stable", ignore_index=True)


HALF = 0.5
"""Share of wrong tower points from which on the thesis' claim is tested: "more than 50%"."""


def claim(table: pd.DataFrame, models: Mapping[str, str]) -> str:
    """Whether SCENE-Net bears out thesis 5.2.5, by rule.

    A model is nearer to the truth than its labels in a seed where its F0.5 against the truth is
    higher than theirs, and leaves the wrong labels out where it detects a smaller share of the
    wrong tower voxels than of the true ones. Looked at where half of the tower points or more are
    wrong, or at the most there is.

    Args:
        table: of ``summarise_noise``.
        models: name -> architecture.
    """
    noisy = table[table["level"] > 0]
    much = noisy[noisy["level"] >= min(HALF, noisy["level"].max())] if len(noisy) else noisy
    nets = [name for name in much["model"].unique() if models.get(name) == "scenenet"]
    if not nets:
        return "No SCENE-Net was trained on wrong labels here, so that is not tested."
    labels = _mean(much[much["model"] == LABELS], "truth_f05")
    said = []
    for name in nets:
        own = much[much["model"] == name]
        n, better = int(own["n_seeds"].sum()), int(own["better_seeds"].sum())
        wrong, true = _mean(own, "wrong_detected"), _mean(own, "truth_recall")
        how = {n: "does", 0: "does not"}.get(better, "does so in some")
        out = "leaves the wrong ones out" if wrong < true else "does not leave the wrong ones out"
        said.append(
            f"{name} {how} ({better} of {n} trainings, F0.5 {_mean(own, 'truth_f05'):.2f} against "
            f"the truth), and {out} ({wrong:.0%} of the wrong tower voxels detected, {true:.0%} of "
            "the true ones)"
        )
    return (
        f"Does it come nearer to the truth than labels of which {much['share'].mean():.0%} are "
        f"wrong, whose own F0.5 is {labels:.2f}? {'; '.join(said)}."
    )


def findings(table: pd.DataFrame) -> list[str]:
    """What each model makes of wrong labels, in numbers, a sentence each.

    Args:
        table: of ``summarise_noise``.
    """
    noisy = table[table["level"] > 0]
    labels = noisy[noisy["model"] == LABELS]
    said = [f"{LABELS}: F0.5 {_listed(labels['truth_f05'])} at {_shares(labels)} wrong"]
    for model, own in noisy[noisy["model"] != LABELS].groupby("model", sort=False):
        better = ", ".join(f"{row.better_seeds} of {row.n_seeds}" for row in own.itertuples())
        said.append(
            f"{model}: F0.5 {_listed(own['truth_f05'])} against the truth at {_shares(own)} "
            f"wrong labels, more than theirs in {better} seeds; it detects "
            f"{_listed(own['wrong_detected'])} of the wrong tower voxels and "
            f"{_listed(own['truth_recall'])} of the true ones"
        )
    return said


def _mean(rows: pd.DataFrame, column: str) -> float:
    return float(rows[column].mean())


def _listed(values: pd.Series) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


def _shares(rows: pd.DataFrame) -> str:
    return ", ".join(f"{share:.0%}" for share in rows["share"])
