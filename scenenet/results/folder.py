"""The result files of a run, read for tables, figures, MLflow and the report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from scenenet.detection.survey_tower import SurveyTower, read_towers
from scenenet.evaluation.result import Evaluation
from scenenet.interpretability.result import ModelCertificate
from scenenet.models.settings import BOOSTED_TREES, boosted_trees_of
from scenenet.pointcloud.quality.report import SurveyReport
from scenenet.prediction.summary import PredictionSummary
from scenenet.results.interactive_crop import InteractiveCrop
from scenenet.results.result_files import read_result, read_table, read_typed
from scenenet.results.seed_result import SeedResult
from scenenet.training.tuning_result import Tuning

if TYPE_CHECKING:
    from scenenet.experiments.studies.settings import StudySettings


@dataclass(frozen=True)
class Prediction:
    """A classified survey.

    Attributes:
        summary: what was classified, with which model.
        towers: the tower list.
        page: its page, if there is one.
        spans, clearances: the tables of its lines, a row per span; None without lines.
    """

    summary: PredictionSummary
    towers: Sequence[SurveyTower]
    page: Path
    spans: pd.DataFrame | None = None
    clearances: pd.DataFrame | None = None


@dataclass(frozen=True)
class Results:
    """A result folder and the parts of the configuration that its results depend on.

    Nothing is read on construction. If a stage has no results, the result is empty or None; a
    broken file is an error.

    Attributes:
        folder: the result folder.
        models: name of each model -> its architecture (``scenenet`` or ``cnn``).
        seeds: seeds of the trainings.
        surveys: surveys of the data set.
        predicted: new surveys that were classified.
        studies: the studies of the run.
        experiments: names of the experiments of the run (``scenenet.experiments.registry``).
        predicts: the model that classifies surveys; None for the first SCENE-Net.
        observers: names of the models of other targets, each trained from the first seed.
        observed: surveys that only these are trained on.
    """

    folder: Path
    models: Mapping[str, str]
    seeds: Sequence[int]
    surveys: Sequence[str] = ()
    predicted: Sequence[str] = ()
    studies: Sequence[StudySettings] = ()
    experiments: Sequence[str] = ()
    predicts: str | None = None
    observers: Sequence[str] = ()
    observed: Sequence[str] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "folder", Path(self.folder))

    @property
    def predicting(self) -> str | None:
        """The model that classifies surveys; figures and the summary show it. None without
        models."""
        scenenets = [model for model, kind in self.models.items() if kind == "scenenet"]
        named = [] if self.predicts is None else [self.predicts]
        return next(
            (name for name in [*named, *scenenets, *self.models] if name in self.models), None
        )

    @cached_property
    def trained(self) -> list[SeedResult]:
        """Every model and seed that has been evaluated, in the order of the configuration."""
        return [
            self.seed(model, seed)
            for model in self.models
            for seed in self.seeds
            if self._evaluation(model, seed).exists()
        ]

    def of_model(self, model: str) -> list[SeedResult]:
        """The evaluated trainings of one model."""
        return [result for result in self.trained if result.model == model]

    def champion(self, model: str) -> SeedResult | None:
        """The seed that is best on the validation crops, the first one in a tie."""
        tuned = [result for result in self.of_model(model) if result.tuning is not None]
        return max(tuned, key=lambda result: result.decisive, default=None)

    def seed(self, model: str, seed: int) -> SeedResult:
        """Read all results of one training.

        Raises:
            InputError: it has not been evaluated, or a file is broken.
        """
        tuned = self._files("models", model, f"seed-{seed}")
        return self._seed(model, self.models[model], seed, tuned)

    def observer(self, name: str) -> SeedResult | None:
        """An observer, trained, tuned and evaluated; None if it was not evaluated."""
        if not self.seeds or not self._evaluation(name, self.seeds[0]).exists():
            return None
        return self._seed(name, "scenenet", self.seeds[0], self._files("models", ".", name))

    def _seed(self, model: str, kind: str, seed: int, tuned: tuple[Path, ...]) -> SeedResult:
        training = self.folder / "train" / model / f"seed-{seed}"
        evaluation = read_typed(self._evaluation(model, seed), Evaluation.from_json)
        tuning = self.folder / "tune" / model / f"seed-{seed}.json"
        history, provenance = training / "history.csv", training / "provenance.json"
        resources = training / "resources.json"
        return SeedResult(
            model=model,
            kind=kind,
            seed=seed,
            evaluation=evaluation,
            tuning=read_typed(tuning, Tuning.from_json) if tuning.exists() else None,
            history=read_table(history) if history.exists() else None,
            provenance=read_result(provenance) if provenance.exists() else None,
            resources=read_result(resources) if resources.exists() else None,
            model_files=tuned,
        )

    def interactive_crop(self, rank: str) -> InteractiveCrop | None:
        """The best, median or worst test crop as voxels; None if there is none."""
        path = self.folder / "interactive_crop" / f"{rank}.json"
        return read_typed(path, InteractiveCrop.from_json) if path.exists() else None

    def certificate(self, model: str) -> ModelCertificate | None:
        """Which properties of a GENEO a model has; None if that was not verified."""
        path = self.folder / "certificate" / f"{model}.json"
        return read_typed(path, ModelCertificate.from_json) if path.exists() else None

    def timing(self, model: str) -> Mapping[str, Any] | None:
        """Inference time of a model; None if it was not measured."""
        return self._if_there("inference_time", f"{model}.json")

    def boosted_trees_times(self) -> Mapping[str, Any] | None:
        """Time of the boosted trees to train and to predict a crop; None if not measured."""
        return self._if_there("boosted_trees", "times.json")

    @cached_property
    def boosted_trees(self) -> list[SeedResult]:
        """The boosted trees, trained from each seed."""
        found = [self._trees(BOOSTED_TREES, ".", seed) for seed in self.seeds]
        return [trees for trees in found if trees is not None]

    def trees_of_observer(self, name: str) -> SeedResult | None:
        """The boosted trees trained beside an observer; None if they were not."""
        return self._trees(boosted_trees_of(name), name, self.seeds[0]) if self.seeds else None

    def _trees(self, model: str, folder: str, seed: int) -> SeedResult | None:
        path = self.folder / "boosted_trees" / folder / f"seed-{seed}.json"
        if not path.exists():
            return None
        return SeedResult(model, BOOSTED_TREES, seed, read_typed(path, Evaluation.from_json))

    def study_runs(self, study: str) -> pd.DataFrame | None:
        """The runs of a study, a row per variant and seed; None if it was not run."""
        path = self.folder / "study" / study / "runs.csv"
        return read_table(path) if path.exists() else None

    def study_times(self, study: str) -> pd.DataFrame | None:
        """The times of a study, a row per variant and seed; None if it was not run."""
        path = self.folder / "study" / study / "times.csv"
        return read_table(path) if path.exists() else None

    def experiment_runs(self, experiment: str) -> pd.DataFrame:
        """The runs of an experiment, a row per training (and way to count).

        Raises:
            InputError: the experiment was not run.
        """
        return read_table(self.folder / experiment / "runs.csv")

    def experiment_times(self, experiment: str) -> pd.DataFrame | None:
        """The times of an experiment, a row per training; None if it was not run."""
        path = self.folder / experiment / "times.csv"
        return read_table(path) if path.exists() else None

    def checks(self) -> dict[str, SurveyReport]:
        """The check report of each survey, including those that only observers are trained on and
        those that are only classified."""
        surveys = dict.fromkeys([*self.surveys, *self.observed, *self.predicted])
        return self._each(
            surveys, "check", "report.json", lambda path: read_typed(path, SurveyReport.from_json)
        )

    def class_counts(self) -> dict[str, pd.DataFrame]:
        """Points of each class (code, class, points, share_percent) of each survey."""
        return self._each(self.surveys, "check", "classes.csv", read_table)

    def towers(self) -> dict[str, pd.DataFrame]:
        """The labelled towers of each survey, one row per tower."""
        return self._each(self.surveys, "towers", "towers.csv", read_table)

    def true_towers(self) -> dict[str, pd.DataFrame]:
        """The true towers of each survey whose truth is known."""
        found = self._each(self.surveys, "towers", "true_towers.csv", read_table)
        return {survey: table for survey, table in found.items() if len(table)}

    def crops(self) -> dict[str, list[Mapping[str, Any]]]:
        """The entries of the crops of each survey (``scenenet.dataset.crops``)."""
        manifests = self._each(self.surveys, "crops", "manifest.json", read_result)
        return {survey: manifest["crops"] for survey, manifest in manifests.items()}

    def grid_times(self) -> pd.DataFrame | None:
        """Time and size of every crop on the grids of the thesis
        (``scenenet.evaluation.voxelisation_time``)."""
        path = self.folder / "voxelisation_time" / "times.csv"
        return read_table(path) if path.exists() else None

    def split(self) -> pd.DataFrame | None:
        """The part of each crop (``scenenet.dataset.split``)."""
        path = self.folder / "split" / "split.csv"
        return read_table(path) if path.exists() else None

    def prediction(self, survey: str) -> Prediction | None:
        """Summary and tower list of a classified survey; None if it was not classified.

        Raises:
            InputError: one of the two files is there and the other is not.
        """
        folder = self.folder / "predict" / survey
        summary, towers = folder / f"{survey}.summary.json", folder / f"{survey}.towers.geojson"
        if not summary.exists() and not towers.exists():
            return None
        read = read_typed(summary, PredictionSummary.from_json)
        spans, clearances = (folder / f"{survey}.{name}.csv" for name in ("spans", "clearances"))
        return Prediction(
            read,
            read_towers(towers),
            folder / f"{survey}.html",
            read_table(spans) if read.line is not None else None,
            read_table(clearances) if read.line and read.line["clearances"] else None,
        )

    def review_counts(self, survey: str) -> Mapping[str, Mapping[str, int]]:
        """Number of ``towers`` of a survey with each decision, and of ``conductors`` where it has a
        line; empty without a review."""
        record = self._if_there("review", f"{survey}/{survey}.reviewed.json")
        if record is None:
            return {}
        conductors = record["conductors"]
        return {"towers": record["counts"]} | ({"conductors": conductors} if conductors else {})

    def provenances(self) -> list[tuple[str, Mapping[str, Any]]]:
        """Every provenance record with its path in the result folder, sorted.

        The records of the report and of MLflow are left out: they are written during or after the
        report, so that two reports of the same results would differ.
        """
        found = []
        for path in sorted(self.folder.glob("**/*provenance.json")):
            place = path.relative_to(self.folder)
            unfinished = any(part.startswith(".") for part in place.parts)
            if not unfinished and place.parts[0] not in ("report", "mlflow"):
                found.append((place.as_posix(), read_result(path)))
        return found

    def _if_there(self, stage: str, name: str) -> Mapping[str, Any] | None:
        path = self.folder / stage / name
        return read_result(path) if path.exists() else None

    def _evaluation(self, model: str, seed: int) -> Path:
        return self.folder / "evaluate" / model / f"seed-{seed}.json"

    def _files(self, stage: str, folder: str, stem: str) -> tuple[Path, ...]:
        candidates = (
            self.folder / stage / folder / f"{stem}{s}" for s in (".json", ".safetensors")
        )
        return tuple(path for path in candidates if path.exists())

    def _each(
        self,
        surveys: Iterable[str],
        stage: str,
        name: str,
        read: Callable[[Path], Any],
    ) -> dict[str, Any]:
        paths = {survey: self.folder / stage / survey / name for survey in surveys}
        return {survey: read(path) for survey, path in paths.items() if path.exists()}
