"""Figures of the experiments: cross-validation and label noise."""

from __future__ import annotations

from pathlib import Path

from scenenet.experiments.cross_validation.summary import summarise_folds
from scenenet.experiments.label_noise.summary import summarise_noise
from scenenet.figures.plots.experiments import cross_validation, noise
from scenenet.results.folder import Results


def draw_noise(results: Results, out: Path) -> tuple[str, str]:
    summary = summarise_noise(results.experiment_runs("label_noise"))
    alt = noise(summary, out)
    return alt, (
        "Trained and tuned on labels that are wrong by a known share, scored on towers further "
        "down the line, on the left against labels as wrong as those and on the right against the "
        f"truth. Mean and standard deviation over {summary['n_seeds'].max()} seeds, each with a "
        "line of its own. Dashed: how good the labels themselves are. Thesis 5.2.5."
    )


def draw_cross_validation(results: Results, out: Path) -> tuple[str, str]:
    runs = results.experiment_runs("cross_validation")
    alt = cross_validation(runs, out)
    row = summarise_folds(runs).iloc[0]
    return alt, (
        f"Each of {row['crops']} crops is left out once, in {row['n_folds']} folds; models are "
        "trained and tuned on the others. Points: means over the folds; bars: standard deviation "
        f"of that mean over {row['n_seeds']} seeds; strokes: F0.5 of each fold, mean over seeds."
    )


EXPERIMENT_DRAWINGS = {
    "cross_validation": ("Every crop a test crop once", draw_cross_validation),
    "label_noise": ("Trained on wrong labels", draw_noise),
}
"""Title and drawing of each experiment."""
