"""Tables of times: they differ between two equal runs, so they stand apart from the scores."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from scenenet.experiments.published import Thesis
from scenenet.results.folder import Results


def seed_times(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Time and peak memory of every training of the models, one row per model and seed."""
    columns = ["model", "seed", "epochs", "training_seconds", "peak_memory_mb"]
    rows = [
        (
            result.model,
            result.seed,
            result.epochs,
            result.seconds,
            (result.resources or {}).get("peak_memory_mb"),
        )
        for result in results.trained
    ]
    return pd.DataFrame(rows, columns=columns)


def experiment_times(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Times of the studies and experiments: means over the trainings of each variant or model."""
    columns = ["experiment", "case", "n_trainings", "training_seconds", "training_seconds_std",
               "inference_ms"]  # fmt: skip
    rows = []
    for name, times in _measured(results):
        key = "variant" if "variant" in times else "model"
        for case, group in times.groupby(key, sort=False):
            seconds = group["training_seconds"]
            inference = group["inference_ms"].mean() if "inference_ms" in group else None
            rows.append((name, case, len(group), seconds.mean(), seconds.std(), inference))
    return pd.DataFrame(rows, columns=columns)


def _measured(results: Results) -> Iterator[tuple[str, pd.DataFrame]]:
    """Name and times of every study and experiment that was run."""
    named = {study.name: results.study_times(study.name) for study in results.studies}
    named |= {name: results.experiment_times(name) for name in results.experiments}
    return ((name, times) for name, times in named.items() if times is not None)
