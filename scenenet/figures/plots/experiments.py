"""Charts of the experiments.

Every function writes one PNG and returns its alternative text.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from scenenet.experiments.components.settings import WITHOUT
from scenenet.experiments.components.summary import leading as leading_components
from scenenet.experiments.cross_validation.summary import (
    CASE,
    case_name,
    leading,
    summarise_folds,
)
from scenenet.experiments.label_noise.settings import LABELS
from scenenet.figures.plots.style import COLOURS, new_figure, save
from scenenet.metrics.score_columns import CHART_SCORES, score_text

PANELS = {
    "labels_f05": "compared with labels of the same quality",
    "truth_f05": "compared with the truth",
}
LABELS_COLOUR, FOLD_COLOUR = "#222222", "#777777"


def label_noise(summary: pd.DataFrame, out: str | Path) -> str:
    """F0.5 over the share of wrong labels; one panel compares with the labels, one with the truth.

    Args:
        summary: of ``scenenet.experiments.label_noise.summary``.
        out: PNG to write.
    """
    figure, axes = new_figure(1, 2, width=9, height=4.2, sharey=True)
    names = [name for name in summary["model"].unique() if name != LABELS]
    for axis, (column, title) in zip(axes[0], PANELS.items(), strict=True):
        for i, name in enumerate(names):
            group = summary[summary["model"] == name]
            spread = group[f"{column}_std"].fillna(0)
            axis.errorbar(
                100 * group["share"], group[column], yerr=spread, fmt="o-", ms=4, capsize=3,
                color=COLOURS[i % len(COLOURS)], label=name,
            )  # fmt: skip
        labels = summary[summary["model"] == LABELS]
        if column == "truth_f05":
            axis.plot(100 * labels["share"], labels[column], "--", color=LABELS_COLOUR,
                      label=LABELS)  # fmt: skip
        axis.set_title(title, fontsize=10)
        axis.set(xlabel="mislabelled tower points [%]", ylim=(-0.02, 1.02))
    axes[0, 0].set_ylabel("F0.5, mean and standard deviation")
    handles, words = axes[0, 1].get_legend_handles_labels()
    figure.legend(handles, words, loc="outside lower center", ncols=5, frameon=False, fontsize=9)
    save(figure, out)
    worst = summary[summary["level"] == summary["level"].max()]
    scores = [
        f"{row.model} {score_text(row.labels_f05)} and {score_text(row.truth_f05)}"
        for row in worst.itertuples()
    ]
    return (
        "Two line charts of F0.5 over the share of wrong labels, compared with the labels and with "
        f"the truth. At {worst['share'].iloc[0]:.0%}: {'; '.join(scores)}."
    )


def cross_validation(runs: pd.DataFrame, out: str | Path) -> str:
    """Precision, recall and F0.5 of each model, and F0.5 of each of its folds, against the truth
    where it is known.

    Args:
        runs: of ``scenenet.experiments.cross_validation.run``.
        out: PNG to write.
    """
    summary = summarise_folds(runs)
    start = leading(runs)
    places = np.arange(len(summary))
    figure, axes = new_figure(1, 1, width=7.2, height=0.6 * len(summary) + 1.5)
    axis = axes[0, 0]
    for i, (name, label) in enumerate((c.name, c.label) for c in CHART_SCORES):
        at = places + 0.2 * (i - 1)
        spread = summary[f"{start}{name}_std"].fillna(0)
        axis.errorbar(summary[f"{start}{name}"], at, xerr=spread, fmt="o", ms=6, capsize=3,
                      color=COLOURS[i], label=label)  # fmt: skip
    folds = runs.groupby([*CASE, "fold"], sort=False)[f"{start}f05"].mean()
    cases = list(zip(*(summary[name] for name in CASE), strict=True))
    for place, case in zip(places, cases, strict=True):
        of_model = folds[case]
        axis.plot(of_model, np.full(len(of_model), place + 0.36), "|", ms=7, mew=1.5,
                  color=FOLD_COLOUR, label="F0.5 of a fold" if place == 0 else None)  # fmt: skip
    axis.set_yticks(places, [case_name(*case) for case in cases])
    against = "the truth" if start else "the labels"
    axis.set(xlabel=f"score against {against}: mean over folds, with its spread over seeds",
             xlim=(-0.02, 1.02))  # fmt: skip
    axis.invert_yaxis()
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    save(figure, out)
    scores = "; ".join(
        f"{case_name(row['model'], row['voxels'])}: "
        f"precision {score_text(row[f'{start}precision'])}, "
        f"recall {score_text(row[f'{start}recall'])}, F0.5 {score_text(row[f'{start}f05'])}, "
        f"folds from {score_text(row[f'{start}worst_fold_f05'])} to "
        f"{score_text(row[f'{start}best_fold_f05'])}"
        for row in summary.to_dict("records")
    )
    return f"Cross-validated scores of each model against {against} as points. {scores}."


def components(summary: pd.DataFrame, out: str | Path) -> str:
    """F0.5 of points of each source, with rules and without, against the truth where it is known.

    Args:
        summary: of ``scenenet.experiments.components.summary``.
        out: PNG to write.
    """
    start = leading_components(summary)
    column = f"{start}point_f05"
    names = list(dict.fromkeys(summary["model"]))
    figure, axes = new_figure(1, 1, width=7.2, height=0.4 * len(names) + 1.5)
    axis = axes[0, 0]
    for colour, (label, chosen) in enumerate(
        {
            "without rules": summary["rules"] == WITHOUT,
            "with rules, or its own answer": summary["rules"] != WITHOUT,
        }.items()
    ):
        rows = summary[chosen]
        at = np.array([names.index(name) for name in rows["model"]]) - 0.1 + 0.2 * colour
        to_worst = (rows[column] - rows[f"{column}_worst"]).fillna(0)
        axis.errorbar(rows[column], at, xerr=[to_worst, 0 * to_worst], fmt="o", ms=6, capsize=3,
                      color=COLOURS[colour], label=label)  # fmt: skip
    axis.set_yticks(range(len(names)), names)
    against = "the truth" if start else "the labels"
    axis.set(xlabel=f"F0.5 of points against {against}: mean and worst seed", xlim=(-0.02, 1.02))
    axis.invert_yaxis()
    figure.legend(loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    save(figure, out)
    scores = "; ".join(
        f"{row['model']}, {row['rules']}: {score_text(row[column])}"
        for row in summary.to_dict("records")
    )
    return f"F0.5 of the points of each source of answers against {against} as points. {scores}."
