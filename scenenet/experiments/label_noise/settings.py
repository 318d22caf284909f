"""Settings of the experiment with label noise."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, model_validator

from scenenet.core.settings import Settings
from scenenet.experiments.contenders import Contender, fault_of
from scenenet.models.settings import Positive
from scenenet.synthetic.settings import SyntheticSettings

AGAINST = ("labels", "truth")
"""What the predictions of a model are compared with."""
LABELS = "the labels"
"""Name in the column `model` of the labels themselves, scored as if a model had predicted them."""

Seed = Annotated[int, Field(ge=0)]
Level = Annotated[float, Field(ge=0, lt=1)]


class LabelNoiseSettings(Settings):
    """Training on labels of which a known share is wrong (thesis 5.2.5), on synthetic lines, where
    the truth is known."""

    levels: tuple[Level, ...] = Field(
        (), description="shares of mislabelled tower points, each below 1; empty for no label noise"
    )
    seeds: tuple[Seed, ...] = Field(
        (0, 1, 2),
        min_length=1,
        description="every model is trained once per seed, on the line of that seed",
    )
    line: dict[str, Any] = Field(
        default_factory=dict,
        description="settings of the synthetic line as in synthetic.surveys; by default 24 "
        "towers and seed 100, to which each of the seeds above is added",
    )
    training: Positive = Field(6, description="training towers, from the start of the line")
    validation: Positive = Field(
        3,
        description="validation towers, on which tau is chosen; one tower before and one after "
        "them is left out, and the rest of the line is for tests",
    )
    contenders: tuple[Contender, ...] = Field(
        (),
        description="models that take part in addition to the boosted trees; empty for every model",
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        try:
            towers = self.line_of(0).towers
        except ValidationError as error:
            raise ValueError(f"label_noise.line: {fault_of(error)}") from None
        if towers < self.training + self.validation + 3:
            raise ValueError(
                f"label_noise: {towers} towers are too few for {self.training} to train on, "
                f"{self.validation} to tune on, two left out and one to test on"
            )
        if len(set(self.levels)) < len(self.levels):
            raise ValueError("label_noise.levels: a level is listed more than once")
        return self

    def line_of(self, seed: int) -> SyntheticSettings:
        """The synthetic line of one of the seeds, without annotation noise yet."""
        line = SyntheticSettings(**({"towers": 24, "seed": 100} | self.line))
        return line.model_copy(update={"seed": line.seed + seed})
