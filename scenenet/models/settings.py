"""The settings of training and tuning (thesis 5.2.1), apart from the code that follows them.

They stand by themselves because reading the configuration must not load torch.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from scenenet.core.settings import Settings
from scenenet.dataset.voxels import Measurement

Positive = Annotated[int, Field(ge=1)]
KernelSize = tuple[Positive, Positive, Positive]
BOOSTED_TREES = "boosted trees"
"""What tables call the boosted trees of ``scenenet.baselines.boosted_trees``."""
THESIS_GENEOS = ("cylinder", "arrow", "negative_sphere")


Protocol = Literal["thesis", "operational"]
Init = Literal["thesis", "informed", "unranged", "handcrafted"]
OF_RANGES: tuple[Init, ...] = ("unranged", "handcrafted")
"""Starts that say something of ranges, which a CNN does not have."""


class MetricSettings(Settings):
    """A SCENE-Net in metres. None of these is trained; docs/method/operational_protocol.md gives
    the reason of each."""

    radius: float = Field(3.0, gt=0, description="m, how far the kernels reach in plan")
    above: float = Field(6.0, ge=0, description="m, how far they reach up")
    below: float = Field(6.0, ge=0, description="m, how far they reach down")
    section_radius: float = Field(
        2.1,
        ge=0,
        description="m, half the mean width of a tower (thesis 5.1.2): a voxel is as much tower "
        "as the one that is most so within this distance in plan",
    )
    section_above: float = Field(
        2.0, ge=0, description="m, the same upwards, as a tower's foot has ground about it"
    )
    false_weight: float = Field(
        2.0,
        gt=0,
        description="weight of a false voxel in the F0.5 that numbers and tau are chosen by: what "
        "is right on the crops at hand is too bold elsewhere",
    )
    whole_towers: bool = Field(
        True,
        description="a voxel is called a tower's where it belongs to a tower that is found, body "
        "and all (docs/method/detection.md); false for where it reaches tau, as in the thesis",
    )


class SearchSettings(Settings):
    """How the eleven numbers of a SCENE-Net in metres are found."""

    searches: int = Field(
        4, ge=1, description="searches that are begun; the best of them is gone on with"
    )
    trial: int = Field(15, ge=0, description="generations after which the best is chosen")
    starts: int = Field(
        64, ge=1, description="numbers drawn at first for each; it begins at the best of them"
    )
    population: int = Field(14, ge=4, description="numbers tried in a generation")
    generations: int = Field(60, ge=1, description="steps of a search, the trial among them")
    step: float = Field(0.7, gt=0, description="first step size, in units of the logit")


class LossSettings(Settings):
    """The GENEO loss (thesis 4.5), and what was tried in its stead (5.3.3)."""

    fidelity: Literal["squared", "cross_entropy"] = Field(
        "squared",
        description="how far an answer is from the truth: squared error (thesis 4.5), or cross "
        "entropy with the same weights (5.3.3)",
    )
    penalty: Literal["linear", "quadratic"] = Field(
        "linear",
        description="h(x) of a negative number: -x (thesis Figure 4.5), or x^2 as at first (5.3.3)",
    )
    alpha: float = Field(5.0, ge=0, description="emphasis of the weighting scheme f_w")
    epsilon: float = Field(0.1, gt=0, description="smallest weight before normalisation")
    rho_shape: float = Field(5.0, ge=0, description="rho_t, penalty on negative shape parameters")
    rho_mixing: float = Field(5.0, ge=0, description="rho_l, penalty on negative mixing weights")


class TrainingSettings(Settings):
    """How a model is trained."""

    init: Init = Field(
        "thesis",
        description="thesis: numbers drawn once; informed: the best of many draws on the training "
        "crops, and for a CNN Fisher's discriminant of tower voxels' surroundings and others'; "
        "for a SCENE-Net also (thesis 5.3.4) unranged: drawn from N(0, 1), ranges or not, and "
        "handcrafted: the values that stand beside each kernel, the same for every seed",
    )
    epochs: int = Field(50, ge=1, description="passes over the training set")
    batch_size: int = Field(8, ge=1, description="crops a step")
    optimiser: Literal["rmsprop", "adam", "sgd"] = Field("rmsprop", description="torch optimiser")
    learning_rate: float = Field(0.001, gt=0, description="step size of the optimiser")
    decay: float = Field(
        0.0, ge=0, lt=1, description="share that the learning rate loses every so often (5.3.4)"
    )
    decay_every: int = Field(10, ge=1, description="epochs from one such loss to the next")
    loss: LossSettings = LossSettings()

    @model_validator(mode="before")
    @classmethod
    def _old_names(cls, raw: Any) -> Any:
        if isinstance(raw, Mapping) and raw.get("init") == "field":
            raise ValueError("init 'field' is now called 'informed'; write init: informed")
        return raw

    def rate(self, epoch: int) -> float:
        """The learning rate of an epoch, counted from 1."""
        return self.learning_rate * (1 - self.decay) ** ((epoch - 1) // self.decay_every)


UNUSED: Mapping[str, tuple[str, ...]] = {
    "cnn": ("metric", "search", "geneos"),
    "thesis": ("metric", "search", "n_kernels"),
    "operational": ("training", "kernel_size", "n_kernels"),
}
"""Settings that change nothing, for a CNN and for a SCENE-Net of each protocol."""


def unused_settings(raw: Mapping[str, Any]) -> tuple[str, ...]:
    """Settings without effect for the ``kind`` and ``protocol`` in ``raw``."""
    return UNUSED.get("cnn" if raw.get("kind") == "cnn" else raw.get("protocol", "thesis"), ())


class ModelSettings(Settings):
    """One architecture and the protocol it is trained by."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_-]*$", description="name in results and tables")
    kind: Literal["scenenet", "cnn"] = Field(description="architecture")
    protocol: Protocol = Field(
        "thesis",
        description="thesis: kernels in voxels, trained by gradient (thesis 5.2.1); operational: "
        "a SCENE-Net in metres, searched for, for use on real surveys "
        "(docs/method/operational_protocol.md)",
    )
    metric: MetricSettings = MetricSettings()
    search: SearchSettings = SearchSettings()
    geneos: tuple[str, ...] = Field(
        THESIS_GENEOS, min_length=1, description="kernels of a SCENE-Net; a name may be repeated"
    )
    n_kernels: int = Field(3, ge=1, description="kernels of a CNN")
    kernel_size: KernelSize = Field((9, 9, 9), description="(kz, ky, kx) in voxels")
    measurement: Measurement = Field("presence", description="phi (thesis 4.2.2, 5.3.2)")
    training: TrainingSettings = TrainingSettings()

    @model_validator(mode="before")
    @classmethod
    def _old_names(cls, raw: Any) -> Any:
        if not isinstance(raw, Mapping):
            return raw
        if raw.get("protocol") == "field":
            raise ValueError(
                "protocol 'field' is now called 'operational'; write protocol: operational"
            )
        if "field" in raw:
            raise ValueError("the settings 'field' are now called 'metric'; write metric: instead")
        if without_effect := [name for name in unused_settings(raw) if name in raw]:
            what = (
                "a cnn"
                if raw.get("kind") == "cnn"
                else (f"a SCENE-Net of protocol {raw.get('protocol', 'thesis')}")
            )
            raise ValueError(f"{', '.join(without_effect)}: without effect for {what}; remove it")
        return raw

    @model_serializer(mode="wrap")
    def _effective(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Only what has an effect, so that records of a model do not name anything else."""
        raw = dump(self)
        return {name: raw[name] for name in raw if name not in unused_settings(raw)}

    @classmethod
    def after_changes(cls, raw: dict[str, Any], changed: set[str]) -> dict[str, Any]:
        unused = unused_settings(raw)
        return {name: raw[name] for name in raw if name in changed or name not in unused}

    @model_validator(mode="after")
    def _start_fits(self) -> Self:
        if self.kind == "cnn" and self.training.init in OF_RANGES:
            raise ValueError(
                f"training.init {self.training.init} is for a SCENE-Net; a CNN has no ranges"
            )
        return self


class TuningSettings(Settings):
    """What is chosen on the validation part, by F0.5 (thesis 5.2.7)."""

    kernel_sizes: tuple[KernelSize, ...] = Field(
        (),
        description="further sizes (kz, ky, kx) that the kernels of a SCENE-Net are sampled at; "
        "the size it was trained with is always tried, and a CNN has no other",
    )
