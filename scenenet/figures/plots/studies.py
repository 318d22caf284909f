"""A study in one figure: a row per variant, or a map if two settings are varied."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from scenenet.figures.plots.style import COLOURS, legend, new_figure, save
from scenenet.metrics.score_columns import CHART_SCORES, score_text


def rows(summary: pd.DataFrame, out: str | Path) -> str:
    """Precision, recall and F0.5 of each variant, with their spread over seeds.

    Args:
        summary: of ``scenenet.experiments.studies.summary``; scores of the thesis are hollow.
        out: PNG to write.
    """
    places = np.arange(len(summary))
    figure, axes = new_figure(1, 1, width=7.2, height=0.42 * len(summary) + 1.3)
    axis = axes[0, 0]
    for i, (name, label) in enumerate((c.name, c.label) for c in CHART_SCORES):
        at = places + 0.22 * (i - 1)
        style = {"color": COLOURS[i], "capsize": 2}
        spread = summary[f"{name}_std"].fillna(0)
        axis.errorbar(summary[name], at, xerr=spread, fmt="o", ms=5, label=label, **style)
        published = f"thesis_{name}"
        if published in summary and summary[published].notna().any():
            axis.plot(summary[published], at, "o", mfc="none", mec=COLOURS[i], ms=9, ls="none")
    axis.set_yticks(places, summary["variant"])
    axis.set(xlabel="score, mean and standard deviation over seeds", xlim=(-0.02, 1.02))
    axis.invert_yaxis()
    legend(axis)
    save(figure, out)
    scores = "; ".join(
        f"{row.variant}: precision {score_text(row.precision)}, recall {score_text(row.recall)}, "
        f"F0.5 {score_text(row.f05)}"
        for row in summary.itertuples()
    )
    return f"Scores of each variant as points. {scores}."


def heat_map(
    summary: pd.DataFrame, names: tuple[str, str], shape: tuple[int, int], out: str | Path
) -> str:
    """F0.5 over two varied settings.

    Args:
        summary: of ``scenenet.experiments.studies.summary``, one row per combination, the second
            setting varying fastest.
        names: of the two settings.
        shape: how many values each has.
        out: PNG to write.
    """
    scores = summary["f05"].to_numpy().reshape(shape)
    labels = summary["variant"].str.split(", ").str
    figure, axes = new_figure(1, 1, width=1.1 * shape[1] + 2.6, height=0.42 * shape[0] + 1.4)
    axis = axes[0, 0]
    axis.grid(False)
    image = axis.imshow(scores, cmap="viridis", aspect="auto", vmin=0)
    for i, j in np.ndindex(*shape):
        dark = scores[i, j] < 0.6 * np.nanmax(scores)
        axis.text(j, i, f"{scores[i, j]:.2f}", ha="center", va="center", fontsize=8,
                  color="white" if dark else "black")  # fmt: skip
    values = [labels[k].str.rpartition(" ")[2].to_numpy().reshape(shape) for k in (0, 1)]
    axis.set_yticks(range(shape[0]), values[0][:, 0])
    axis.set_xticks(range(shape[1]), values[1][0])
    axis.set(ylabel=names[0], xlabel=names[1])
    figure.colorbar(image, ax=axis, label="F0.5")
    save(figure, out)
    best = summary.loc[summary["f05"].idxmax()]
    return (
        f"Map of F0.5 over {names[0]} and {names[1]}, from {np.nanmin(scores):.2f} to "
        f"{np.nanmax(scores):.2f}; the best is {best['variant']}."
    )
