"""Line charts: training, precision and recall.

Every function draws plain data into one PNG and returns its alternative text, which contains the
numbers that the chart shows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from scenenet.figures.plots.style import COLOURS, legend, new_figure, readable, save

Curve = Mapping[str, Sequence[float | None]]
"""Lists ``precision`` and ``recall`` of one length, tau ascending, as evaluation writes them."""


def training(histories: Mapping[str, pd.DataFrame], out: str | Path) -> str:
    """Loss per epoch, a line per training; the validation loss is dashed, if there is one.

    Args:
        histories: label -> table with columns epoch, loss and perhaps validation_loss.
        out: PNG to write.
    """
    figure, axes = new_figure(1, 1, width=7.2, height=3.8)
    axis = axes[0, 0]
    for i, (label, history) in enumerate(histories.items()):
        colour = COLOURS[i % len(COLOURS)]
        axis.plot(history["epoch"], history["loss"], color=colour, label=label)
        if "validation_loss" in history and history["validation_loss"].notna().any():
            axis.plot(history["epoch"], history["validation_loss"], "--", color=colour, lw=1)
    every = np.concatenate([h["loss"].to_numpy(float) for h in histories.values()])
    if every.size and np.nanmin(every) > 0 and np.nanmax(every) > 10 * np.nanmin(every):
        axis.set_yscale("log")
    axis.set(xlabel="epoch", ylabel="loss")
    legend(axis)
    save(figure, out)
    ends = "; ".join(
        f"{label} from {h['loss'].iloc[0]:.3g} to {h['loss'].iloc[-1]:.3g}"
        for label, h in histories.items()
    )
    return f"Line chart of the training loss over the epochs: {ends}."


def parameter_paths(
    histories: Mapping[str, pd.DataFrame], names: Sequence[str], out: str | Path
) -> str:
    """Every parameter over the epochs, a panel per parameter and a line per training.

    Args:
        histories: label -> table with a column ``epoch`` and one for each of ``names``.
        names: parameters, such as ``cylinder.r``.
        out: PNG to write.
    """
    columns = min(4, len(names))
    rows = -(-len(names) // columns)
    figure, axes = new_figure(rows, columns, width=9, height=1.9 * rows + 0.4, sharex=True)
    for axis, name in zip(axes.flat, names, strict=False):
        for i, (label, history) in enumerate(histories.items()):
            colour = COLOURS[i % len(COLOURS)]
            axis.plot(history["epoch"], history[name], color=colour, lw=1.2, label=label)
        axis.set_title(readable(name), fontsize=9)
    for axis in list(axes.flat)[len(names) :]:
        axis.set_visible(False)
    for axis in axes[-1]:
        axis.set_xlabel("epoch")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, frameon=False, fontsize=8)
    save(figure, out)
    return (
        f"Small line charts of {len(names)} parameters over the epochs, "
        f"one line for each of {len(histories)} trainings: {', '.join(names)}."
    )


def precision_recall(
    curves: Mapping[str, Sequence[Curve]],
    out: str | Path,
    published: Mapping[str, tuple[float, float]] | None = None,
) -> str:
    """Precision against recall with changing tau (thesis Figure 5.7).

    A thin line is one seed, the thick line the mean precision over the seeds at each recall, the
    band one standard deviation around it. A seed counts as precision 0 at a recall that it
    does not reach, so that a dead model lowers the mean instead of being left out.

    Args:
        curves: model -> one curve per seed.
        out: PNG to write.
        published: model -> (recall, precision) to mark as the thesis' point.
    """
    figure, axes = new_figure(1, 1, width=6.4, height=4.8)
    axis = axes[0, 0]
    at = np.linspace(0, 1, 201)
    summary = []
    for i, (model, of_seeds) in enumerate(curves.items()):
        colour = COLOURS[i % len(COLOURS)]
        sampled = np.array([_precision_at(curve, at) for curve in of_seeds])
        mean, spread = sampled.mean(axis=0), sampled.std(axis=0)
        area = np.array([_area(curve) for curve in of_seeds])
        if len(of_seeds) > 1:
            low, high = (mean - spread).clip(0, 1), (mean + spread).clip(0, 1)
            axis.fill_between(at, low, high, color=colour, alpha=0.15, lw=0)
            for line in sampled:
                reached = line > 0
                axis.plot(at[reached], line[reached], color=colour, lw=0.7, alpha=0.5)
        plus_minus = f" ± {area.std(ddof=1):.3f}" if len(of_seeds) > 1 else ""
        axis.plot(
            at, mean, color=colour, lw=2.2, label=f"{model}, area {area.mean():.3f}{plus_minus}"
        )
        summary.append(f"{model} has an area of {area.mean():.3f}{plus_minus}")
        if published and model in published:
            axis.plot(*published[model], "D", ms=8, mfc="none", mec=colour, mew=1.8,
                      label=f"{model} in the thesis, at its tau")  # fmt: skip
    every = [curve["recall"] for of in curves.values() for curve in of]
    reached = [recall for of in every for recall in of if recall is not None]
    reached += [recall for recall, _ in (published or {}).values()]
    end = min(1.0, 1.15 * max(reached, default=1.0)) or 1.0
    axis.set(xlabel="recall", ylabel="precision", xlim=(0, end), ylim=(0, 1.02))
    legend(axis)
    save(figure, out)
    return f"Precision-recall curves on the test crops: {'; '.join(summary)}."


def _precision_at(curve: Curve, recall: np.ndarray) -> np.ndarray:
    """Precision at which a curve first has each recall; 0 at a recall that it does not reach."""
    have = np.asarray(curve["recall"], float)
    precision = np.asarray(curve["precision"], float)
    # By recall, and the higher precision first where several thresholds have the same.
    order = np.lexsort((-precision, have))
    place = np.searchsorted(have[order], recall, side="left")
    return np.append(precision[order], 0.0)[place]


def _area(curve: Curve) -> float:
    """Average precision: the sum over tau of precision times the gain of recall."""
    gained = -np.diff(np.append(np.asarray(curve["recall"], float), 0.0))
    return float((np.asarray(curve["precision"], float) * gained).sum())
