"""The tables of thesis chapter 5, made from result files, with the numbers of the thesis.

Every function returns a data frame for one CSV file. If a run has no results for a table (no survey
was checked), the table keeps its columns and has no rows. Spread is always the sample standard
deviation over seeds, empty for a single seed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from scenenet.core.files import atomic, digest, sha256
from scenenet.experiments.published import Thesis
from scenenet.experiments.registry import EXPERIMENTS
from scenenet.experiments.studies.summary import summarise
from scenenet.metrics.score_columns import SCORES, TRUTH
from scenenet.results.dataset_tables import classes, dataset, towers, voxelisation
from scenenet.results.folder import Results
from scenenet.results.model_tables import certificate, parameters, times, turns
from scenenet.results.observer_tables import observers
from scenenet.results.score_tables import (
    models,
    point_scores,
    seeds,
    tower_scores,
    whole_towers,
)
from scenenet.results.time_tables import experiment_times, seed_times


class Table(NamedTuple):
    """A table of every run.

    Attributes:
        title: a few words.
        section: section of the report that it belongs to.
        make: the table of a result folder.
        times: whether it has times, which differ between two equal runs.
    """

    title: str
    section: str
    make: Callable[[Results, Thesis], pd.DataFrame]
    times: bool = False


TABLES: Mapping[str, Table] = {
    "classes": Table("Points of each class", "data", classes),
    "towers": Table("Labelled towers", "data", towers),
    "dataset": Table("Crops and true towers", "data", dataset),
    "voxelisation": Table("Voxelisation", "data", voxelisation, times=True),
    "models": Table("Scores of each model", "models", models),
    "seeds": Table("Scores of each seed", "models", seeds),
    "whole_towers": Table("Voxels at or above tau, and whole towers", "models", whole_towers),
    "tower_scores": Table("Towers found", "models", tower_scores),
    "point_scores": Table("Points of the towers found", "models", point_scores),
    "observers": Table("Observers of other targets", "observers", observers),
    "times": Table("Times", "models", times, times=True),
    "seed_times": Table("Times of each seed", "models", seed_times, times=True),
    "experiment_times": Table(
        "Times of studies and experiments", "models", experiment_times, times=True
    ),
    "parameters": Table("Learned parameters in metres", "learned", parameters),
    "certificate": Table("Verified properties", "learned", certificate),
    "certificate_turns": Table("Change of the output under rotation", "learned", turns),
}
"""Every table by the stem of its file; the workflow writes and shows all of them."""

DATASET_TABLES = tuple(
    name for name, table in TABLES.items() if table.section == "data" and not table.times
)
"""Stems of the tables that the surveys and crops alone decide."""

COMPARISONS = {
    "claims": "Claims of the thesis",
    "claims_times": "Claims of the thesis about times",
    "published_numbers": "Published numbers",
    "published_numbers_times": "Published times",
}
"""Stems and titles of the tables of ``scenenet.results.claims`` and ``published_numbers``."""


def table_titles() -> dict[str, tuple[str, str]]:
    """Stem of each table, those of the experiments included -> its title and its section."""
    titles = {name: (table.title, table.section) for name, table in TABLES.items()}
    titles |= {name: (title, "thesis") for name, title in COMPARISONS.items()}
    return titles | {name: (one.title, one.section) for name, one in EXPERIMENTS.items()}


def write_tables(
    results: Results, thesis: Thesis, out: str | Path, names: Iterable[str] = tuple(TABLES)
) -> list[Path]:
    """Write tables as CSV files.

    Args:
        results: the result folder.
        thesis: published numbers.
        out: folder to write to.
        names: stems of ``TABLES``. The tables of the studies (``study-NAME.csv``) and of the
            experiments are always written.

    Returns:
        the files.
    """
    made = {name: TABLES[name].make(results, thesis) for name in names}
    for study in results.studies:
        runs = results.study_runs(study.name)
        if runs is not None:
            made[f"study-{study.name}"] = summarise(study, runs, thesis)
    for name in results.experiments:
        made[name] = EXPERIMENTS[name].summarise(results.experiment_runs(name))
    paths = []
    for name, table in made.items():
        path = Path(out) / f"{name}.csv"
        with atomic(path) as partial:
            table.to_csv(partial, index=False, float_format="%.6g")
        paths.append(path)
    return paths


def digest_scores(folder: str | Path, names: Iterable[str]) -> dict[str, Any]:
    """A digest of the tables without times; two equal runs have the same.

    Args:
        folder: with the tables.
        names: stems of all tables of the run, those with times included.

    Returns:
        ``digest``, and ``tables``: stem -> sha256 of its file.
    """
    timed = {name for name, table in TABLES.items() if table.times}
    timed |= {name for name in COMPARISONS if name.endswith("_times")}
    compared = sorted(set(names) - timed)
    prints = {name: sha256(Path(folder) / f"{name}.csv") for name in compared}
    return {"digest": digest(prints), "tables": prints}


def print_scores(folder: str | Path, dataset: str, grid: str) -> None:
    """Print the scores of every model, if the tables of the run have been written.

    Args:
        folder: the result folder.
        dataset, grid: what the scores are of, for the heading.
    """
    file = Path(folder) / "tables" / "models.csv"
    if not file.exists():
        return
    scores = pd.read_csv(file)
    known = scores[f"{TRUTH}f05"].notna().any()
    for against, start in (("truth", TRUTH), ("labels", ""))[0 if known else 1 :]:
        shown = scores[["model", "counted", *(f"{start}{name}" for name in SCORES)]]
        print(
            f"\nScores on the test crops of {dataset}, {grid}, tower voxels, against the {against}:"
        )
        shown = shown.rename(columns=lambda name: name.removeprefix(TRUTH))
        print(shown.to_string(index=False, float_format="%.3f", na_rep="-"))
    print(f"Report: {folder}/report/index.html")
