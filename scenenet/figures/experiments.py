"""Figures of the experiments.

Every function that draws writes one PNG and returns (alternative text, caption).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import pandas as pd

from scenenet.experiments.components.summary import leading as leading_components
from scenenet.experiments.components.summary import summarise_components
from scenenet.experiments.cross_validation.summary import leading, summarise_folds
from scenenet.experiments.label_noise.summary import summarise_label_noise
from scenenet.figures.plots.experiments import components, cross_validation, label_noise


def draw_label_noise(runs: pd.DataFrame, out: Path) -> tuple[str, str]:
    summary = summarise_label_noise(runs)
    return label_noise(summary, out), (
        "F0.5 of models that were trained and tuned on labels of which a known share is wrong, on "
        "test towers further along the line. Left: compared with labels of the same quality. "
        "Right: "
        f"compared with the truth. Mean and standard deviation over {summary['n_seeds'].max()} "
        "seeds, each with its own line. Dashed: the labels themselves. Thesis 5.2.5."
    )


def draw_cross_validation(runs: pd.DataFrame, out: Path) -> tuple[str, str]:
    row = summarise_folds(runs).iloc[0]
    return cross_validation(runs, out), (
        f"Cross-validation over {row['crops']} crops in {row['n_folds']} folds: models are tested "
        "on one fold, trained and tuned on the others; scores are against "
        f"{'the truth' if leading(runs) else 'the labels'}. Points: mean over the folds. Bars: "
        "standard "
        f"deviation of that mean over {row['n_seeds']} seeds. Ticks: F0.5 of each fold, mean over "
        "seeds."
    )


def draw_components(runs: pd.DataFrame, out: Path) -> tuple[str, str]:
    summary = summarise_components(runs)
    against = "the truth" if leading_components(summary) else "the labels"
    return components(summary, out), (
        f"F0.5 of the points of {summary['crops'].max()} test crops against {against}, with "
        "detection rules and without. Points: mean over the seeds. Lines: to the worst seed. Rules "
        "alone: every occupied voxel is a candidate. Nothing was chosen on these crops."
    )


EXPERIMENT_DRAWINGS: Mapping[str, Callable[[pd.DataFrame, Path], tuple[str, str]]] = {
    "cross_validation": draw_cross_validation,
    "components": draw_components,
    "label_noise": draw_label_noise,
}
"""How the runs of each experiment of ``scenenet.experiments.registry`` are drawn."""
