"""The tables of the trainings of a study or an experiment: scores in one file, times in another.

Two equal runs have equal scores, but never equal times.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from scenenet.core.files import atomic

TIMES = ("training_seconds", "inference_ms")
"""Columns that differ between two equal runs."""


def write_runs(
    rows: Sequence[Mapping[str, Any]],
    columns: Sequence[str],
    training: Sequence[str],
    out: str | Path,
    out_times: str | Path,
) -> pd.DataFrame:
    """Write the scores and the times of trainings.

    Args:
        rows: scores and times together, one or more per training.
        columns: of the table of scores.
        training: columns that identify a training.
        out: CSV file of the scores.
        out_times: CSV file of the times: ``training`` and those of ``TIMES`` that were measured, a
            row per training.

    Returns:
        the table of scores.
    """
    table = pd.DataFrame(rows)
    measured = [name for name in TIMES if name in table]
    times = table[[*training, *measured]].drop_duplicates(list(training))
    scores = table[list(columns)]
    for part, path in ((scores, out), (times.dropna(how="all", subset=measured), out_times)):
        with atomic(path) as partial:
            part.to_csv(partial, index=False, float_format="%.6g")
    return scores


def with_times(runs: pd.DataFrame, times: pd.DataFrame) -> pd.DataFrame:
    """The table of scores with the times of each training as further columns."""
    return runs.merge(times, how="left", on=[name for name in times if name not in TIMES])
