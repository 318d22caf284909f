"""Colours, axes and saving, common to all figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.files import atomic
from scenenet.pointcloud.class_schemes import ROLE_COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 130
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#666666")
"""Distinguishable for colour-blind readers (Okabe and Ito)."""

TOWER_COLOUR = ROLE_COLOURS["tower"]
BACKGROUND_COLOUR = ROLE_COLOURS["other"]
OUTCOME_COLOURS = {
    "false positive": COLOURS[4],
    "true positive": COLOURS[2],
    "false negative": COLOURS[3],
}
CONTRIBUTION_COLOURS = ("#2166AC", "#E1E1E1", "#B2182B")
"""Of a contribution of -100 %, 0 and 100 %, as in the colour map RdBu of the kernels."""


def new_figure(
    rows: int,
    columns: int,
    *,
    width: float,
    height: float,
    sharex: bool = False,
    sharey: bool = False,
    height_ratios: Sequence[float] | None = None,
) -> tuple[Figure, np.ndarray]:
    """A figure without pyplot, which needs no display and keeps no state between calls."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(
        rows, columns, squeeze=False, sharex=sharex, sharey=sharey, height_ratios=height_ratios
    )
    for axis in axes.flat:
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(True, color="#00000018", lw=0.6)
        axis.set_axisbelow(True)
    return figure, axes


def save(figure: Figure, out: str | Path) -> None:
    with atomic(out) as partial:
        # Without the version of matplotlib in the file, equal pictures are equal files.
        figure.savefig(partial, dpi=DPI, facecolor="white", metadata={"Software": None})


def legend(axis: Axes) -> None:
    axis.legend(frameon=False, fontsize=9)


def readable(name: str) -> str:
    """``negative_sphere.r_c`` -> ``negative sphere r_c``; ``lambda.arrow`` -> ``λ arrow``."""
    head, _, tail = name.partition(".")
    return f"λ {readable(tail)}" if head == "lambda" else f"{head.replace('_', ' ')} {tail}".strip()
