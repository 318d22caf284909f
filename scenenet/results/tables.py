"""The tables of thesis chapter 5 from result files, the thesis' numbers beside ours.

Every function returns a data frame for one CSV. A table for which a run has left nothing (no
survey was checked) keeps its columns and has no rows. Spread is always the sample
standard deviation over seeds, empty for a single seed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from scenenet.core.files import atomic
from scenenet.experiments.published import Thesis
from scenenet.experiments.registry import EXPERIMENT_TABLES
from scenenet.experiments.studies.summary import summarise
from scenenet.results.folder import Results
from scenenet.results.model_tables import certificate, parameters, times, turns

if TYPE_CHECKING:
    import pandas as pd
from scenenet.results.dataset_tables import classes, towers, voxelisation
from scenenet.results.score_tables import models, seeds, tower_scores, whole_towers

TABLES: Mapping[str, Callable[[Results, Thesis], pd.DataFrame]] = {
    "classes": classes,
    "towers": towers,
    "voxelisation": voxelisation,
    "models": models,
    "seeds": seeds,
    "whole_towers": whole_towers,
    "tower_scores": tower_scores,
    "times": times,
    "parameters": parameters,
    "certificate": certificate,
    "certificate_turns": turns,
}
"""Every table by the stem of its file. A new one is added here and the report finds it."""


def write_tables(
    results: Results, thesis: Thesis, out: str | Path, names: Iterable[str] = tuple(TABLES)
) -> list[Path]:
    """Write the tables called ``names`` as ``out/NAME.csv``, those of the studies as
    ``out/study-NAME.csv`` and those of the experiments by their names."""
    made = {name: TABLES[name](results, thesis) for name in names}
    for study in results.studies:
        runs = results.study_runs(study.name)
        if runs is not None:
            made[f"study-{study.name}"] = summarise(study, runs, thesis)
    for experiment in results.experiments:
        runs = results.experiment_runs(experiment)
        made[experiment] = EXPERIMENT_TABLES[experiment](runs)
    paths = []
    for name, table in made.items():
        path = Path(out) / f"{name}.csv"
        with atomic(path) as partial:
            table.to_csv(partial, index=False, float_format="%.6g")
        paths.append(path)
    return paths


def print_scores(folder: str | Path, dataset: str, grid: str) -> None:
    """Print the scores of every model, if the tables of the run have been written.

    Args:
        folder: the result folder.
        dataset, grid: what the scores are of, for the heading.
    """
    import pandas as pd

    file = Path(folder) / "tables" / "models.csv"
    if not file.exists():
        return
    columns = ["model", "counted", "precision", "recall", "f05", "iou_tower", "miou"]
    scores = pd.read_csv(file)[columns]
    print(f"\nScores on the test crops of {dataset}, {grid}, tower voxels:")
    print(scores.to_string(index=False, float_format="%.3f", na_rep="-"))
    print(f"Report: {folder}/report/index.html")
