"""Models beside each other over seeds: against wrong labels and against the truth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scenenet.contests.noise_table import LABELS, summarise_noise
from scenenet.figures.style import COLOURS, new_figure, save
from scenenet.results import Results

if TYPE_CHECKING:
    import pandas as pd

PANELS = {"labels_f05": "against the labels it was given", "truth_f05": "against the truth"}
LABELS_COLOUR = "#222222"


def noise(summary: pd.DataFrame, out: str | Path) -> str:
    """F0.5 over the share of wrong labels, a panel for each thing it is measured against.

    Args:
        summary: of ``scenenet.contests.noise_table``.
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


def draw_noise(results: Results, out: Path) -> tuple[str, str]:
    summary = summarise_noise(results.contest_runs("noise"))
    alt = noise(summary, out)
    return alt, (
        "Trained and tuned on labels that are wrong by a known share, scored on towers further "
        "down the line, on the left against labels as wrong as those and on the right against the "
        f"truth. Mean and standard deviation over {summary['n_seeds'].max()} seeds, each with a "
        "line of its own. Dashed: how good the labels themselves are. Thesis 5.2.5."
    )


CONTEST_DRAWINGS = {"noise": ("Trained on wrong labels", draw_noise)}
"""Title and drawing of each contest."""
