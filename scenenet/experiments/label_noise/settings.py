"""Settings of the experiment with label noise."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, model_validator

from scenenet.core.settings import Settings
from scenenet.experiments.contenders import Contender, _fault
from scenenet.models.settings import Positive
from scenenet.synthetic.settings import SyntheticSettings

AGAINST = ("labels", "truth")
"""What a model that was trained on wrong labels is scored against."""
SCORES = ("precision", "recall", "f05", "iou_tower")
LABELS = "the labels"
"""What tables call the labels themselves, as if they were the answer of a model."""

Seed = Annotated[int, Field(ge=0)]
Level = Annotated[float, Field(ge=0, lt=1)]


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
        (), description="models that take part beside the boosted trees; none for every model"
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        try:
            towers = self.line_of(0).towers
        except ValidationError as error:
            raise ValueError(f"label_noise.line: {_fault(error)}") from None
        if towers < self.training + self.validation + 3:
            raise ValueError(
                f"label_noise: {towers} towers are too few for {self.training} to train on, "
                f"{self.validation} to tune on, two left out and one to test on"
            )
        if len(set(self.levels)) < len(self.levels):
            raise ValueError("label_noise.levels: a level is there more than once")
        return self

    def line_of(self, seed: int) -> SyntheticSettings:
        """The line of one of the seeds; its annotation noise is yet to be found."""
        line = SyntheticSettings(**({"towers": 24, "seed": 100} | self.line))
        return line.model_copy(update={"seed": line.seed + seed})
