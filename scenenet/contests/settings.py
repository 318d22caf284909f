"""What takes part in a contest, and what it is about."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, model_validator

from scenenet.protocol import ModelSettings, Positive
from scenenet.settings import Settings, changed
from scenenet.synthetic.settings import SyntheticSettings

AGAINST = ("labels", "truth")
"""What a model that was trained on wrong labels is scored against."""
SCORES = ("precision", "recall", "f05", "iou_tower")
LABELS = "the labels"
"""What tables call the labels themselves, as if they were the answer of a model."""

Seed = Annotated[int, Field(ge=0)]
Level = Annotated[float, Field(ge=0, lt=1)]


class Contender(Settings):
    """A model of the configuration, perhaps trained otherwise."""

    model: str = Field(description="name of the model")
    changes: dict[str, Any] = Field(
        default_factory=dict,
        description="dotted settings of the model and their values: training.learning_rate",
    )
    name: str | None = Field(None, description="how tables call it; null for the model's name")


class NoiseSettings(Settings):
    """Training on labels of which a known share is wrong (thesis 5.2.5), on synthetic lines whose
    truth is known."""

    levels: tuple[Level, ...] = Field(
        (), description="share of the points labelled tower that are none; none for no such study"
    )
    seeds: tuple[Seed, ...] = Field(
        (0, 1, 2), min_length=1, description="each has a line of its own and trains every model"
    )
    line: dict[str, Any] = Field(
        default_factory=dict,
        description="the line, where it is another than 24 towers of seed 100, to which the seeds "
        "above are added; settings as in synthetic.surveys",
    )
    training: Positive = Field(6, description="towers to train on, from the start of the line")
    validation: Positive = Field(
        3,
        description="towers to choose tau on; one before and one behind them are left out, and the "
        "rest of the line is tested on",
    )
    contenders: tuple[Contender, ...] = Field(
        (), description="models that take part beside the black box; none for every model"
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        try:
            towers = self.line_of(0).towers
        except ValidationError as error:
            raise ValueError(f"noise.line: {_fault(error)}") from None
        if towers < self.training + self.validation + 3:
            raise ValueError(
                f"noise: {towers} towers are too few for {self.training} to train on, "
                f"{self.validation} to tune on, two left out and one to test on"
            )
        if len(set(self.levels)) < len(self.levels):
            raise ValueError("noise.levels: a level is there more than once")
        return self

    def line_of(self, seed: int) -> SyntheticSettings:
        """The line of one of the seeds; its annotation noise is yet to be found."""
        line = SyntheticSettings(**({"towers": 24, "seed": 100} | self.line))
        return line.model_copy(update={"seed": line.seed + seed})


class CrossValidationSettings(Settings):
    """Every crop once a test crop, where crops are too few for one split to say much."""

    leave_out: int = Field(
        0, ge=0, description="crops left out at a time, in the order of their names; 0 for none"
    )
    contenders: tuple[Contender, ...] = Field(
        (), description="models that take part beside the black box; none for every model"
    )


def contenders(
    told: Sequence[Contender], models: Sequence[ModelSettings], place: str
) -> list[ModelSettings]:
    """The settings of the models that take part, under the names that tables call them.

    Args:
        told: the contenders; without any, every model takes part as it is.
        models: of the configuration.
        place: what to call the setting in messages.

    Raises:
        ValueError: a model or a setting is not known, or two have the same name.
    """
    if not told:
        return list(models)
    known = {model.name: model for model in models}
    chosen = []
    for one in told:
        if one.model not in known:
            raise ValueError(f"{place}: {one.model!r} is not one of the models")
        try:
            changes = {**one.changes, "name": one.name or one.model}
            chosen.append(changed(known[one.model], changes))
        except ValidationError as error:
            raise ValueError(f"{place}, {one.model}: {_fault(error)}") from None
    names = [model.name for model in chosen]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"{place}: {', '.join(twice)} is there more than once")
    return chosen


def _fault(error: ValidationError) -> str:
    fault = error.errors()[0]
    setting = ".".join(map(str, fault["loc"]))
    return f"{setting}: {fault['msg']}" if setting else fault["msg"]
