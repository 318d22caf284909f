"""The configuration of the workflow: the settings models of all stages together.

Settings of a stage are declared with the stage and not here. Reading a configuration does not load
torch, so that the workflow plans in about a second. ``scenenet.config.reference`` writes the JSON
schemas and the table of settings in the repository.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, model_validator

from scenenet.clearance.settings import ClearanceSettings
from scenenet.config.errors import explain
from scenenet.config.observers import ObserverSettings, predicting
from scenenet.config.survey_settings import NewSurveys, Synthetic
from scenenet.config.written import geneos_in, merged, with_values
from scenenet.core.errors import InputError, in_file
from scenenet.core.provenance import FULL_BELOW_BYTES
from scenenet.core.provided_code import KERNELS
from scenenet.core.settings import PathText, Settings
from scenenet.dataset.crops import CropSettings
from scenenet.dataset.labelled_towers import TowerSettings
from scenenet.dataset.split import SplitSettings
from scenenet.dataset.voxels import VoxelSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.experiments.components.settings import ComponentsSettings
from scenenet.experiments.contenders import contenders
from scenenet.experiments.cross_validation.settings import CrossValidationSettings
from scenenet.experiments.label_noise.settings import LabelNoiseSettings
from scenenet.experiments.registry import EXPERIMENTS
from scenenet.experiments.studies.settings import StudySettings
from scenenet.models.settings import (
    IN_WORKFLOW,
    ModelSettings,
    TrainingSettings,
    TuningSettings,
    unused_settings,
)
from scenenet.pointcloud.class_schemes import Codes
from scenenet.pointcloud.quality.check import CheckSettings
from scenenet.pointcloud.targets import WIRE
from scenenet.prediction.settings import PredictSettings
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.tracking.store import TrackingSettings

Seed = Annotated[int, Field(ge=0)]


class Prediction(PredictSettings):
    """How surveys are classified, and by which model."""

    model: str = Field(
        "scenenet", description="name of the model whose best seed classifies surveys"
    )
    observers: tuple[str, ...] = Field(
        (),
        description="names of the observers that predict together with it. One of wires leads to "
        "spans, conductors and clearances",
    )


class Config(Settings):
    """All settings of a run of the workflow."""

    dataset: str = Field(
        "surveys", min_length=1, description="name of the data in MLflow and in the report"
    )
    results_dir: PathText = Field("results", min_length=1, description="folder for every result")
    surveys: PathText | None = Field(
        "config/surveys.tsv", description="survey sheet; null if there are only TS40K samples"
    )
    ts40k_dir: PathText | None = Field(
        None, description="folder of TS40K samples (.npy, .pt) to train on"
    )
    ts40k_codes: Codes = Field(
        "edp",
        description="class scheme of the TS40K samples: edp, or ts40k for the six merged "
        "classes of .pt files",
    )
    new_surveys: NewSurveys = NewSurveys()
    content_below: int = Field(
        FULL_BELOW_BYTES // 1024**2,
        ge=0,
        description="MiB; smaller surveys count as changed if their content changes, larger ones "
        "if their size or date changes, because reading them takes seconds",
    )
    thesis: PathText = Field("config/thesis.yaml", description="published numbers to compare with")
    synthetic: Synthetic = Synthetic()
    check: CheckSettings = CheckSettings()
    towers: TowerSettings = TowerSettings()
    crops: CropSettings = CropSettings()
    voxels: VoxelSettings = VoxelSettings()
    kernels: tuple[PathText, ...] = Field(
        (),
        description="Python files with kernels from outside the package, or folders of them; a "
        "kernel has the name of its file, and its code runs",
    )
    split: SplitSettings = SplitSettings()
    training: TrainingSettings = Field(
        TrainingSettings(), description="training settings of every model that does not set its own"
    )
    models: tuple[ModelSettings, ...] = Field(min_length=1, description="models to train")
    seeds: tuple[Seed, ...] = Field(
        min_length=1, description="every model is trained once from each seed"
    )
    observers: tuple[ObserverSettings, ...] = Field(
        (),
        description="models of other targets, each trained once from the first of `seeds`, on "
        "square crops of the training surveys with the shares of `split`",
    )
    tuning: TuningSettings = TuningSettings()
    boosted_trees: bool = Field(
        True,
        description="train and score boosted trees beside the models and the observers, as a "
        "baseline; cross-validation, `components` and `label_noise` compare with boosted trees in "
        "any case",
    )
    score_towers: bool = Field(
        True,
        description="whether the whole towers of the test crops are scored too, and their points, "
        "as predict answers them; it takes far longer than the scores of voxels at or above tau",
    )
    study_values: Mapping[str, Any] = Field(
        {},
        description="values, by dotted name, for settings that studies change in `common` or in "
        "`changes`; they replace those values in every study",
    )
    only_studies: tuple[str, ...] | None = Field(
        None, description="names of the studies to run; null for all of them"
    )
    study_job: int = Field(
        60, ge=1, description="trainings of a study that one job runs, or one seed of all variants"
    )
    study_crops: int | None = Field(
        None,
        ge=1,
        description="most crops of a part in a study, to train on, to choose tau on and to score, "
        "evenly from those of the split, so that the studies of a large dataset take less time; "
        "null for all of them",
    )
    study_seeds: int | None = Field(
        None,
        ge=1,
        description="most seeds of a study, the first ones of its list, so that studies take less "
        "time; null for all of them",
    )
    studies: tuple[StudySettings, ...] = Field(
        (),
        description="series of short trainings that differ in one setting; see config/studies.yaml",
    )
    cross_validation: CrossValidationSettings = CrossValidationSettings()
    components: ComponentsSettings = ComponentsSettings()
    label_noise: LabelNoiseSettings = LabelNoiseSettings()
    detection: DetectionSettings = DetectionSettings()
    predict: Prediction = Prediction()
    clearance: ClearanceSettings = ClearanceSettings()
    tracking: TrackingSettings = TrackingSettings()

    @model_validator(mode="before")
    @classmethod
    def _renamed(cls, raw: Any) -> Any:
        """Refuse settings of earlier versions by their new name."""
        if isinstance(raw, Mapping) and "noise" in raw:
            raise ValueError("noise: this setting is now called label_noise; rename the key")
        return raw

    @model_validator(mode="before")
    @classmethod
    def _common_training(cls, raw: Any) -> Any:
        """Complete the training settings of every model with the common ones."""
        if not isinstance(raw, Mapping):
            return raw
        common, models = raw.get("training"), raw.get("models")
        if not isinstance(common, Mapping) or not isinstance(models, list | tuple):
            return raw
        filled = [
            {**model, "training": merged(common, model.get("training") or {})}
            if isinstance(model, Mapping) and "training" not in unused_settings(model)
            else model
            for model in models
        ]
        return {**raw, "models": filled}

    @model_validator(mode="after")
    def _chosen_studies(self) -> Self:
        """Leave out the studies and the seeds that are not to be run."""
        names = [study.name for study in self.studies]
        only = names if self.only_studies is None else self.only_studies
        if unknown := [name for name in only if name not in names]:
            raise ValueError(
                f"only_studies: {', '.join(unknown)} is not one of the studies: {', '.join(names)}"
            )
        chosen = tuple(
            study.model_copy(update={"seeds": study.seeds[: self.study_seeds]})
            for study in self.studies
            if study.name in only
        )
        object.__setattr__(self, "studies", chosen)
        return self

    @model_validator(mode="before")
    @classmethod
    def _replaced_in_studies(cls, raw: Any) -> Any:
        """Put ``study_values`` into the studies that change these settings."""
        if not isinstance(raw, Mapping) or not isinstance(raw.get("study_values"), Mapping):
            return raw
        values, studies = raw["study_values"], raw.get("studies")
        if not isinstance(studies, list | tuple):
            return raw
        return {**raw, "studies": [with_values(study, values) for study in studies]}

    @model_validator(mode="after")
    def _listed_once(self) -> Self:
        of_models = [model.name for model in self.models]
        of_observers = [observer.name for observer in self.observers]
        for what, names in (
            ("models", of_models),
            ("models and observers", [*of_models, *of_observers]),
            ("seeds", list(self.seeds)),
            ("synthetic.surveys", [survey.name for survey in self.synthetic.surveys]),
            ("studies", [study.name for study in self.studies]),
        ):
            if twice := [str(name) for name, count in Counter(names).items() if count > 1]:
                raise ValueError(f"{what}: {', '.join(twice)} is listed more than once")
        return self

    @model_validator(mode="after")
    def _models_fit(self) -> Self:
        """Refuse models that the workflow cannot train or compare."""
        whole = [model.name for model in self.models if model.gives_whole_towers]
        if whole and not self.score_towers:
            raise ValueError(
                f"score_towers: {', '.join(whole)} gives whole towers, so they have to be scored; "
                "remove this setting, or set metric.whole_towers: false"
            )
        for model in self.models:
            if not model.finds.is_tower:
                raise ValueError(
                    f"model {model.name}: target {model.target}: models are compared by the towers "
                    "that they find; move it to observers"
                )
            _require_measured_in_workflow(model.name, model)
            if not model.training.epochs:
                raise ValueError(
                    f"model {model.name}: training.epochs 0 is only for a study; give at least 1"
                )
        return self

    @model_validator(mode="after")
    def _named_models_are_listed(self) -> Self:
        """Refuse what names a model that there is not, or one that it cannot use."""
        known = [model.name for model in self.models]
        if self.predict.model not in known:
            raise ValueError(
                f"predict.model: {self.predict.model!r} is not one of the models: "
                f"{', '.join(known)}"
            )
        for study in self.studies:
            if study.model not in known:
                raise ValueError(f"study {study.name}: {study.model!r} is not one of the models")
            for plan in study.plans(self.model_named(study.model), self.voxels, self.split):
                _require_measured_in_workflow(f"{study.model} of study {study.name}", plan.model)
        predicting(self.predict.observers, self.observers)
        self.label_noise_models()
        self.crossed_models()
        return self

    @model_validator(mode="after")
    def _voltage_has_limits(self) -> Self:
        try:
            self.clearance.applied()
        except InputError as error:
            raise ValueError(
                f"clearance.voltage: {error.problem}; add limits to clearance.limits"
            ) from None
        return self

    def label_noise_models(self) -> list[ModelSettings]:
        """The models that are trained with label noise."""
        return contenders(self.label_noise.contenders, self.models, "label_noise.contenders")

    def crossed_models(self) -> list[ModelSettings]:
        """The models that are cross-validated."""
        chosen = self.cross_validation.contenders
        return contenders(chosen, self.models, "cross_validation.contenders")

    def experiments(self) -> list[str]:
        """Names of the experiments that are switched on, in the order of the registry."""
        return [
            name
            for name, experiment in EXPERIMENTS.items()
            if getattr(getattr(self, name), experiment.switch)
        ]

    def measure_shapes(self) -> bool:
        """Whether a model has numbers that are measured at the towers of its crops."""
        return any(
            model.protocol == "operational" and model.metric.numbers == "measured"
            for model in self.models
            if model.kind == "scenenet"
        )

    def outside_kernels(self) -> dict[str, dict[str, str]]:
        """What identifies each kernel from outside the package that the models and the studies
        name (``KernelSource.record``), by name.

        Raises:
            InputError: a kernel cannot be read, or there are several of its name.
        """
        named = geneos_in(self.model_dump(include={"models", "observers", "studies"}))
        sources = {name: KERNELS.source_named(name) for name in sorted(named)}
        return {name: source.record() for name, source in sources.items() if source}

    def predicting_observers(self) -> list[ObserverSettings]:
        """The observers that predict together with the model of towers."""
        return predicting(self.predict.observers, self.observers)

    def finds_lines(self) -> bool:
        """Whether spans, conductors and clearances follow from what predicts."""
        return any(observer.finds.name == WIRE for observer in self.predicting_observers())

    def observer_named(self, name: str) -> ObserverSettings:
        return next(observer for observer in self.observers if observer.name == name)

    def model_named(self, name: str) -> ModelSettings:
        return next(model for model in self.models if model.name == name)

    def study_named(self, name: str) -> StudySettings:
        return next(study for study in self.studies if study.name == name)

    def synthetic_named(self, name: str) -> SyntheticSettings:
        """The settings of a synthetic survey without its name."""
        survey = next(survey for survey in self.synthetic.surveys if survey.name == name)
        return SyntheticSettings(**survey.model_dump(exclude={"name"}))

    def plain(self) -> dict[str, Any]:
        """All settings with defaults, as dicts, lists, strings and numbers."""
        return self.model_dump(mode="json")


def _require_measured_in_workflow(name: str, model: ModelSettings) -> None:
    """Refuse a model whose measurement needs more than the stores of voxels have."""
    if model.measurement not in IN_WORKFLOW:
        raise ValueError(
            f"model {name}: measurement {model.measurement}: the workflow measures "
            f"{' and '.join(IN_WORKFLOW)}; train others with scenenet train --measurement"
        )


def load(raw: Mapping[str, Any], file: str | None = None) -> Config:
    """Validate a configuration and fill in the defaults.

    The files in ``kernels`` are provided to this process and those it starts, because models name
    their kernels.

    Args:
        raw: as read from YAML.
        file: its name in messages.

    Raises:
        InputError: names every wrong key, the problem, and a correct line.
    """
    kernels = raw.get("kernels")
    if isinstance(kernels, list | tuple) and all(isinstance(path, str) for path in kernels):
        with in_file(file or "configuration", "kernels"):
            KERNELS.provide(kernels)
    try:
        return Config.model_validate(dict(raw))
    except ValidationError as error:
        raise InputError(explain(error, Config), file=file or "configuration") from None
