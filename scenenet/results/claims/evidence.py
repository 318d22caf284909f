"""The results of a run by seed, as the claims need them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import pandas as pd

from scenenet.experiments.published import Thesis
from scenenet.experiments.studies.findings import findings
from scenenet.experiments.studies.summary import summarise
from scenenet.metrics.score_columns import SCORES, TRUTH
from scenenet.results import score_tables
from scenenet.results.claims.intervals import mean
from scenenet.results.folder import Results
from scenenet.results.seed_result import SeedResult

EVERYTHING_MARKED = 0.1
"""F0.5 of marking every occupied voxel, if a run has not counted its voxels; tower voxels are about
3 % of the occupied ones in the public crops, which gives 0.04."""


def representative(results: Results, kind: str) -> str | None:
    """The first model of an architecture, preferably one of the thesis protocol."""
    names = [model for model, k in results.models.items() if k == kind]
    for name in names:
        trained = results.of_model(name)
        if trained and settings_of(trained[0]).get("protocol", "thesis") == "thesis":
            return name
    return names[0] if names else None


def settings_of(trained: SeedResult) -> Mapping[str, Any]:
    """The settings of a training; empty if its record has none."""
    return (trained.provenance or {}).get("settings") or {}


class Evidence:
    """The scores of a run. Series have seeds as index and are empty where nothing was measured; a
    score that is not defined, because nothing was detected, is 0."""

    def __init__(self, results: Results, thesis: Thesis) -> None:
        self.results = results
        self._thesis = thesis

    def model(self, kind: str, score: str, live: bool = False) -> pd.Series:
        """A column of table ``seeds`` for the model that represents an architecture.

        Args:
            live: only the seeds whose models detect anything, as the thesis reports the CNN.
        """
        rows = self._seeds[self._seeds["model"] == representative(self.results, kind)]
        if live:
            rows = rows[rows["alive"].astype(bool)]
        if score.startswith(TRUTH) and rows[score].isna().all():
            return _nothing()
        return rows.set_index("seed")[score].astype(float).fillna(0.0)

    def trained(self, kind: str) -> list[SeedResult]:
        """The trainings of the model that represents an architecture."""
        name = representative(self.results, kind)
        return [] if name is None else self.results.of_model(name)

    def has_study(self, study: str) -> bool:
        """Whether the run has results of a study."""
        return self._study(study) is not None

    def study(self, study: str, variant: str, column: str) -> pd.Series:
        """A column of the trainings of a variant of a study."""
        runs = self._study(study)
        if runs is None or column not in runs:
            return _nothing()
        rows = runs[runs["variant"] == variant].set_index("seed")
        values = rows[column].astype(float)
        return values.fillna(0.0) if column in (*SCORES, "average_precision") else values

    def noise(self, kind: str, level: str, column: str) -> pd.Series:
        """A column of the experiment with label noise, at the ``lowest`` or ``highest`` level."""
        if "label_noise" not in self.results.experiments:
            return _nothing()
        runs = self.results.experiment_runs("label_noise")
        rows = runs[runs["model"] == representative(self.results, kind)]
        wanted = rows["level"].min() if level == "lowest" else rows["level"].max()
        return rows[rows["level"] == wanted].set_index("seed")[column].astype(float).fillna(0.0)

    @cached_property
    def trivial(self) -> float:
        """F0.5 of marking every occupied voxel of the crops, the highest over the grids."""
        counted = self.results.grid_times()
        if counted is None or not len(counted):
            return EVERYTHING_MARKED
        sums = counted.groupby("grid")[["tower", "occupied"]].sum()
        precision = float((sums["tower"] / sums["occupied"]).max())
        return 1.25 * precision / (0.25 * precision + 1)

    def lack_of_skill(self, f05: pd.Series) -> str | None:
        """Why models with these F0.5 (seeds,) show no skill; None if they do.

        A skilled model is better than marking nothing and than marking everything: the low end of
        the interval of its F0.5 is above both.
        """
        found = mean(f05)
        if found is None:
            return "detects nothing with any seed, or was not trained"
        if found.n < 2:
            return "has a single seed that detects anything"
        if found.low > self.trivial:
            return None
        return (
            f"has no skill: its F0.5 of {found.value:.2f} ({found.low:.2f} to {found.high:.2f}) is "
            f"not above the {self.trivial:.2f} of marking every occupied voxel"
        )

    def findings(self, study: str | None) -> str:
        """The findings of a study as sentences; empty without them."""
        for one in self.results.studies:
            runs = self.results.study_runs(one.name) if one.name == study else None
            if runs is not None:
                return findings(one, summarise(one, runs, self._thesis))
        return ""

    @cached_property
    def _seeds(self) -> pd.DataFrame:
        return score_tables.seeds(self.results)

    def _study(self, study: str) -> pd.DataFrame | None:
        if study not in self._studies:
            self._studies[study] = self._read(study)
        return self._studies[study]

    @cached_property
    def _studies(self) -> dict[str, pd.DataFrame | None]:
        return {}

    def _read(self, study: str) -> pd.DataFrame | None:
        if study not in [one.name for one in self.results.studies]:
            return None
        runs, times = self.results.study_runs(study), self.results.study_times(study)
        if runs is None or times is None:
            return runs
        return runs.merge(times, on=["variant", "seed"], how="left")


def _nothing() -> pd.Series:
    return pd.Series(dtype=float)
