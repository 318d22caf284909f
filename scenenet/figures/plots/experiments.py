"""Models beside each other over seeds: against wrong labels and against the truth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.experiments.cross_validation.summary import summarise_folds
from scenenet.experiments.label_noise.settings import LABELS
from scenenet.figures.plots.style import COLOURS, new_figure, save

if TYPE_CHECKING:
    import pandas as pd

PANELS = {"labels_f05": "against the labels it was given", "truth_f05": "against the truth"}
MEASURES = {"precision": "precision", "recall": "recall", "f05": "F0.5"}
LABELS_COLOUR, FOLD_COLOUR = "#222222", "#777777"


def noise(summary: pd.DataFrame, out: str | Path) -> str:
    """F0.5 over the share of wrong labels, a panel for each thing it is measured against.

    Args:
        summary: of ``scenenet.experiments.label_noise.summary``.
        out: PNG to write.
    """
    figure, axes = new_figure(1, 2, width=9, height=4.2, sharey=True)
    said = []
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
        axis.set(xlabel="points labelled tower that are none [%]", ylim=(-0.02, 1.02))
    axes[0, 0].set_ylabel("F0.5, mean and standard deviation")
    handles, words = axes[0, 1].get_legend_handles_labels()
    figure.legend(handles, words, loc="outside lower center", ncols=5, frameon=False, fontsize=9)
    save(figure, out)
    worst = summary[summary["level"] == summary["level"].max()]
    for row in worst.itertuples():
        said.append(f"{row.model} {row.labels_f05:.2f} and {row.truth_f05:.2f}")
    return (
        "Two line charts of F0.5 over the share of wrong labels, against the labels and against "
        f"the truth. At {worst['share'].iloc[0]:.0%}: {'; '.join(said)}."
    )


def cross_validation(runs: pd.DataFrame, out: str | Path) -> str:
    """Precision, recall and F0.5 of each model, and F0.5 of each of its folds.

    Args:
        runs: of ``scenenet.experiments.cross_validation.run``.
        out: PNG to write.
    """
    summary = summarise_folds(runs)
    places = np.arange(len(summary))
    figure, axes = new_figure(1, 1, width=7.2, height=0.6 * len(summary) + 1.5)
    axis = axes[0, 0]
    for i, (name, label) in enumerate(MEASURES.items()):
        at = places + 0.2 * (i - 1)
        spread = summary[f"{name}_std"].fillna(0)
        axis.errorbar(summary[name], at, xerr=spread, fmt="o", ms=6, capsize=3, color=COLOURS[i],
                      label=label)  # fmt: skip
    folds = runs.groupby(["model", "fold"], sort=False)["f05"].mean()
    for place, model in zip(places, summary["model"], strict=True):
        of_model = folds[model]
        axis.plot(of_model, np.full(len(of_model), place + 0.36), "|", ms=7, mew=1.5,
                  color=FOLD_COLOUR, label="F0.5 of a fold" if place == 0 else None)  # fmt: skip
    axis.set_yticks(places, summary["model"])
    axis.set(xlabel="score, mean over folds and its spread over seeds", xlim=(-0.02, 1.02))
    axis.invert_yaxis()
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    save(figure, out)
    said = "; ".join(
        f"{row.model}: precision {row.precision:.2f}, recall {row.recall:.2f}, F0.5 {row.f05:.2f}, "
        f"its folds from {row.worst_fold_f05:.2f} to {row.best_fold_f05:.2f}"
        for row in summary.itertuples()
    )
    return f"Points for the cross-validated scores of each model. {said}."
