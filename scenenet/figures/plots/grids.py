"""One crop on several grids: labels and predictions of a model (thesis Figure 5.10)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scenenet.figures.plots.point_clouds import principal_axes
from scenenet.figures.plots.style import (
    BACKGROUND_COLOUR,
    OUTCOME_COLOURS,
    TOWER_COLOUR,
    new_figure,
    save,
)

PANEL = 3.4
"""Inches, width of a panel."""

OUTCOMES = {"false positive": (True, False), "true positive": (True, True),
            "false negative": (False, True)}  # fmt: skip
"""Outcome -> predicted, labelled; later ones are drawn over earlier ones."""


class GridView(NamedTuple):
    """A crop on one grid.

    Attributes:
        title: resolution and voxel size.
        centres: (M, 3) m, of the occupied voxels.
        size: m, their edge.
        tower: (M,) bool, labels.
        probability: (M,) of a model.
    """

    title: str
    centres: np.ndarray
    size: float
    tower: np.ndarray
    probability: np.ndarray


def labels_and_predictions(views: Sequence[GridView], tau: float, out: str | Path) -> str:
    """A row per grid, from the side: labels, probability, and the outcome at tau.

    Args:
        views: of one crop.
        tau: voxels at or above it are predicted as tower.
        out: PNG to write. The horizontal axis is the planar direction in which the voxels of the
            first grid spread most; stray voxels far above the others are cut off.

    Returns:
        its alternative text.
    """
    turn = principal_axes(views[0].centres[:, :2])[:, 0]
    middle, base = views[0].centres[:, :2].mean(axis=0), views[0].centres[:, 2].min()
    sides = [
        np.stack([(view.centres[:, :2] - middle) @ turn, view.centres[:, 2] - base])
        for view in views
    ]
    (left, right), (low, high) = _frame(views[0], sides[0])
    panel = PANEL * min(1.6, max(0.35, (high - low) / (right - left)))
    figure, axes = new_figure(
        len(views), 3, width=3 * PANEL + 1.4, height=len(views) * (panel + 0.75) + 0.4,
        sharex=True, sharey=True,
    )  # fmt: skip
    shown = None
    for row, view, side in zip(axes, views, sides, strict=True):
        # In points: a voxel is as large as its edge in metres.
        size = (72 * 0.85 * PANEL * view.size / (right - left)) ** 2
        style = {"s": size, "marker": "s", "lw": 0, "rasterized": True}
        predicted = view.probability >= tau
        row[0].scatter(*side[:, ~view.tower], c=BACKGROUND_COLOUR, **style)
        row[0].scatter(*side[:, view.tower], c=TOWER_COLOUR, **style)
        # The most probable last, so that no other voxel hides them.
        order = np.argsort(view.probability, kind="stable")
        shown = row[1].scatter(*side[:, order], c=view.probability[order], cmap="viridis",
                               vmin=0, vmax=1, **style)  # fmt: skip
        row[2].scatter(*side[:, ~view.tower & ~predicted], c=BACKGROUND_COLOUR, **style)
        for name, (detected, labelled) in OUTCOMES.items():
            member = (predicted == detected) & (view.tower == labelled)
            row[2].scatter(*side[:, member], c=OUTCOME_COLOURS[name], label=name, **style)
        row[0].set(ylabel="height [m]", xlim=(left, right), ylim=(low, high))
        for axis, title in zip(row, ("labelled tower", "probability", f"at tau {tau:.3f}"),
                               strict=True):  # fmt: skip
            axis.set_title(f"{title}, {view.title}", fontsize=9)
            axis.set_aspect("equal")
    for axis in axes[-1]:
        axis.set_xlabel("along [m]")
    if shown is not None:
        figure.colorbar(shown, ax=axes[:, 2], label="probability", shrink=0.6, aspect=30)
    handles, labels = axes[0, 2].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(OUTCOMES), frameon=False,
                  fontsize=9)  # fmt: skip
    save(figure, out)
    counts = "; ".join(
        f"{v.title}: {int(v.tower.sum())} of {len(v.tower)} voxels labelled tower, "
        f"{int((v.probability >= tau).sum())} predicted"
        for v in views
    )
    return f"Side views of one crop on {len(views)} grids: labels, probability, outcome. {counts}."


def _frame(view: GridView, side: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Limits of the axes (low, high): as high as 97 % of the voxels and every tower voxel."""
    low, high = side.min(axis=1), np.array([side[0].max(), np.quantile(side[1], 0.97)])
    if view.tower.any():
        high = np.maximum(high, side[:, view.tower].max(axis=1))
    low, high = low - 2 * view.size, high + 2 * view.size
    return np.array([low[0], high[0]]), np.array([low[1], high[1]])
