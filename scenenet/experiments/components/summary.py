"""Table of the experiment: mean and worst over the seeds, and what a model adds to the rules."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from scenenet.experiments.components.settings import ITS_OWN, RULES_ALONE, WITH
from scenenet.metrics.score_columns import TOWER_ONLY_SCORES, TRUTH, score_text
from scenenet.metrics.voxel_scores import Confusion

COUNTED = ("point", "voxel")
"""What is counted; the beginning of the columns."""
_NUMBERS = ("tp", "fp", "fn")
COUNTS = tuple(f"{what}_{n}" for what in COUNTED for n in (*TOWER_ONLY_SCORES, *_NUMBERS))
"""Columns of scores and counts, each also with ``TRUTH`` before its name."""
TOWERS = ("towers", "towers_found", "towers_false")
"""Columns of numbers of towers: those that stand there, those found, and others."""
CASE = ("model", "rules")
"""Columns that identify a row of the table."""

LITTLE = 0.05
"""Gain in F0.5 of points below which a model adds little to the rules."""


def scores_of(counts: Mapping[str, Confusion] | None, against: str) -> dict[str, float | None]:
    """The columns ``COUNTS`` of counts of points and voxels; empty for None.

    Args:
        counts: of each of ``COUNTED``.
        against: beginning of the names of the columns.
    """
    cells: dict[str, float | None] = {}
    for what in COUNTED:
        one = None if counts is None else counts[what]
        for name in TOWER_ONLY_SCORES:
            cells[f"{against}{what}_{name}"] = None if one is None else one.scores()[name]
        for name in _NUMBERS:
            cells[f"{against}{what}_{name}"] = None if one is None else getattr(one, name)
    return cells


def summarise_components(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per source and answer, in the order of ``runs``.

    Args:
        runs: of ``scenenet.experiments.components.run``.

    Returns:
        model, rules, n_seeds; crops: number of crops scored; live_share of the runs; for points and
        voxels each score of the counts of all folds together, mean over seeds, and ``_worst``: its
        lowest; towers; towers_found, towers_false: mean over seeds, and ``_worst``: fewest found,
        most false; parameters. Columns against the truth begin with ``TRUTH`` and come first; they
        are empty where the truth is not known.
    """
    rows = []
    for (model, rules), group in runs.groupby(list(CASE), sort=False):
        row: dict[str, Any] = {
            "model": model,
            "rules": rules,
            "n_seeds": group["seed"].nunique(),
            "crops": sum(len(crops.split()) for crops in group.groupby("fold")["crops"].first()),
            "live_share": group["alive"].astype(float).mean(),
        }
        for against in (TRUTH, ""):
            row |= _of_seeds(group, against)
        rows.append(row | {"parameters": group["parameters"].mean()})
    return pd.DataFrame(rows)


def _of_seeds(group: pd.DataFrame, against: str) -> dict[str, float]:
    """Mean and worst over the seeds, from the counts of all folds of each."""
    names = [f"{against}{what}_{n}" for what in COUNTED for n in _NUMBERS]
    names += [f"{against}{name}" for name in TOWERS]
    by_seed = group[["seed", *names]].astype(float).groupby("seed").sum(min_count=1)
    row: dict[str, float] = {}
    for what in COUNTED:
        counts = by_seed[[f"{against}{what}_{n}" for n in _NUMBERS]].dropna()
        scores = pd.DataFrame(
            [Confusion(*(int(n) for n in each)).scores() for each in counts.to_numpy()],
            columns=list(TOWER_ONLY_SCORES),
            dtype=float,
        )
        for name in TOWER_ONLY_SCORES:
            column = f"{against}{what}_{name}"
            row |= {column: scores[name].mean(), f"{column}_worst": scores[name].min()}
    there, found, false = (by_seed[f"{against}{name}"] for name in TOWERS)
    return row | {
        f"{against}towers": there.mean(),
        f"{against}towers_found": found.mean(),
        f"{against}towers_found_worst": found.min(),
        f"{against}towers_false": false.mean(),
        f"{against}towers_false_worst": false.max(),
    }


def leading(table: pd.DataFrame) -> str:
    """Beginning of the columns to lead with: ``TRUTH`` where it is known, else an empty one."""
    return TRUTH if table[f"{TRUTH}point_f05"].notna().any() else ""


def case_name(model: str, rules: str) -> str:
    """The name of a row in text and figures."""
    return model if rules == ITS_OWN or model == RULES_ALONE else f"{model}, {rules}"


def who_does_the_work(table: pd.DataFrame, models: Mapping[str, str]) -> str:
    """What each SCENE-Net adds to the rules, in sentences that follow a rule.

    A model adds little if its F0.5 of points with rules, mean over seeds, is less than ``LITTLE``
    above that of rules alone.

    Args:
        table: of ``summarise_components``.
        models: name -> architecture.
    """
    start = leading(table)
    column = f"{start}point_f05"
    scores = table.set_index(list(CASE))[[column, f"{column}_worst"]]
    alone = float(scores.loc[(RULES_ALONE, WITH), column])
    against = "the truth" if start else "the labels"
    sentences = [f"F0.5 of points against {against}: rules alone {score_text(alone)}"]
    verdicts = []
    for model in (name for name, kind in models.items() if kind == "scenenet"):
        if (model, WITH) not in scores.index:
            continue
        mean, worst = scores.loc[(model, WITH)].astype(float)
        sentences.append(f"{model} with rules {score_text(mean)} (worst seed {score_text(worst)})")
        gain = mean - alone
        how = "little to the rules" if gain < LITTLE else "to the rules"
        verdicts.append(f"{model} adds {how} ({gain:+.2f})")
    return f"{'; '.join(sentences)}. {'; '.join(verdicts)}." if verdicts else f"{sentences[0]}."
