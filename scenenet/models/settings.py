"""The settings of models, training and tuning (thesis 5.2.1).

They are separate from the code that uses them, because reading the configuration must not load
torch.
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from scenenet.core.provided_code import KERNELS
from scenenet.core.settings import Settings
from scenenet.measurement.registry import PRESENCE, MeasurementName
from scenenet.pointcloud.targets import ROLES, TOWER, Target, canonical

LARGEST_KERNEL = 64
"""Largest edge of a kernel, voxels: that of a tile, beyond which a survey cannot be predicted."""

Positive = Annotated[int, Field(ge=1)]
Edge = Annotated[int, Field(ge=1, le=LARGEST_KERNEL)]
KernelSize = tuple[Edge, Edge, Edge]

LARGEST_RATE = 1e38
"""Largest learning rate: float32, in which models are trained, has hardly larger numbers."""

LARGEST_LENGTH = 20.0
"""Largest length of a SCENE-Net in metres, m. It observes voxels of at least 2/3 m (the blocks of
``scenenet.convolution.coarsening``), so that its kernels stay within ``LARGEST_KERNEL``."""

BOOSTED_TREES = "boosted trees"
"""Name in tables of the model of ``scenenet.baselines.boosted_trees``."""


def boosted_trees_of(observer: str) -> str:
    """Name of the boosted trees that are trained beside an observer."""
    return f"{BOOSTED_TREES} of {observer}"


THESIS_GENEOS = ("cylinder", "arrow", "negative_sphere")

Protocol = Literal["thesis", "operational"]
Mixing = Literal["convex", "maximum", "product"]
Init = Literal["thesis", "informed", "unranged", "handcrafted", "published"]
IN_WORKFLOW = ("presence", "density")
"""Measurements of the workflow. Its crops and its work files keep no other fields of points."""
GENEO_INITS: tuple[Init, ...] = ("unranged", "handcrafted", "published")
"""Initialisations that only a SCENE-Net has, because a CNN has no parameter ranges."""


def _known_kernel(name: str) -> str:
    """Refuse the name of a GENEO kernel that there is none of.

    A kernel has the name of its file. The files are listed and not imported, because that would
    load torch; kernels that this process has registered are known once the registry is loaded.
    """
    known = KERNELS.known()
    if registry := sys.modules.get("scenenet.geneo.registry"):
        known |= set(registry.kernel_names())
    if name not in known:
        close = difflib.get_close_matches(name, sorted(known), n=1)
        hint = f"did you mean {close[0]!r}?" if close else "provide the file of another kernel"
        raise ValueError(f"{name!r} is not one of the kernels {', '.join(sorted(known))}; {hint}")
    return name


Kernel = Annotated[str, AfterValidator(_known_kernel)]
TargetText = Annotated[str, AfterValidator(canonical)]
"""What a model finds (``scenenet.pointcloud.targets``), as ``Target.text``."""
Length = Annotated[float, Field(ge=0, le=LARGEST_LENGTH)]


def _without_defaults(
    settings: Settings, dump: SerializerFunctionWrapHandler, *names: str
) -> dict[str, Any]:
    """Settings of later versions stand in records only where they differ from what every earlier
    version did, so that the records of its models stay the same."""
    raw: dict[str, Any] = dump(settings)
    for name in names:
        if getattr(settings, name) == type(settings).model_fields[name].default:
            raw.pop(name, None)
    return raw


class MetricSettings(Settings):
    """The fixed lengths and rules of a SCENE-Net in metres. docs/method/operational_protocol.md
    gives the reasons."""

    numbers: Literal["measured", "searched"] = Field(
        "measured",
        description="measured: radius, reach and their tolerances are those of the labelled "
        "towers, measured in points, and kernels and cross-sections follow them; searched: all "
        "numbers are those with the highest F0.5, from which radius and reach cannot be read "
        "(docs/method/numbers.md)",
    )
    radius: float = Field(
        3.0,
        gt=0,
        le=LARGEST_LENGTH,
        description="m, horizontal reach of the kernels; with measured numbers beyond the body",
    )
    above: Length = Field(6.0, description="m, upward reach of the kernels")
    below: Length = Field(6.0, description="m, downward reach of the kernels")
    section_radius: Length = Field(
        2.1,
        description="m, radius of the cross-section from which a voxel takes the strongest "
        "response; half the mean width of a tower (thesis 5.1.2)",
    )
    section_above: Length = Field(
        2.0,
        description="m, height of the cross-section above the voxel; only upwards, because the "
        "foot of a tower is surrounded by ground",
    )
    false_weight: float = Field(
        2.0,
        gt=0,
        description="weight of a false positive voxel in the F0.5 that selects parameters and tau; "
        "above 1 because models find more false positives on other data than on their training "
        "crops",
    )
    observed: float = Field(
        1.0,
        ge=0.1,
        le=2.0,
        description="m, edge of the blocks of voxels in which a finer grid is observed: a metre "
        "for towers, less for what is thinner and closer together",
    )
    mixing: Mixing = Field(
        "convex",
        description="how the kernels become one observer: their weighted sum (thesis Eq. 4.1), the "
        "largest weighted response, or the product of their probabilities "
        "(docs/method/observers.md). A first observer is a weighted sum",
    )
    whole_towers: bool = Field(
        True,
        description="predict all voxels of detected towers, bodies included "
        "(docs/method/detection.md); false predicts the voxels at or above tau, as in the thesis",
    )

    @model_serializer(mode="wrap")
    def _without_new(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return _without_defaults(self, dump, "observed", "mixing")


class SearchSettings(Settings):
    """The search for the parameters of a SCENE-Net in metres."""

    result: Literal["best", "middle"] = Field(
        "best",
        description="best: the numbers with the highest score; middle: the mean of all random "
        "initial points whose score is hardly lower than the highest, for numbers that few crops "
        "do not determine. There are no generations then",
    )
    hardly: float | None = Field(
        0.02,
        ge=0,
        description="middle: loss of score up to which an initial point counts as hardly lower; "
        "null for one standard error of the difference between the crops, which needs crops of "
        "several lines (docs/method/decisions.md)",
    )
    near_best: float = Field(
        0.0,
        ge=0,
        lt=1,
        description="middle: share of the initial points that are drawn around the best of the "
        "others; for scores that are high in a small part of the range only",
    )
    searches: int = Field(4, ge=1, description="searches started; only the best continues")
    trial: int = Field(15, ge=0, description="generations after which the best search is chosen")
    starts: int = Field(
        64, ge=1, description="random initial points of each search, which starts at the best one"
    )
    population: int = Field(14, ge=4, description="candidates per generation")
    generations: int = Field(60, ge=1, description="generations of a search, trial included")
    step: float = Field(0.7, gt=0, description="initial step size, in units of the logit")

    @model_serializer(mode="wrap")
    def _without_new(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return _without_defaults(self, dump, "result", "hardly", "near_best")


class LossSettings(Settings):
    """The GENEO loss (thesis 4.5) and its alternatives (5.3.3)."""

    fidelity: Literal["squared", "cross_entropy"] = Field(
        "squared",
        description="difference between probability and label: squared error (thesis 4.5), or "
        "cross entropy with the same weights (5.3.3)",
    )
    penalty: Literal["linear", "quadratic"] = Field(
        "linear",
        description="h(x) of a negative parameter: -x (thesis Figure 4.5), or x^2 (5.3.3)",
    )
    alpha: float = Field(5.0, ge=0, description="emphasis of the weighting scheme f_w")
    epsilon: float = Field(0.1, gt=0, description="smallest weight before normalisation")
    rho_shape: float = Field(5.0, ge=0, description="rho_t, penalty on negative shape parameters")
    rho_mixing: float = Field(5.0, ge=0, description="rho_l, penalty on negative mixing weights")


class TrainingSettings(Settings):
    """Training by gradient."""

    init: Init = Field(
        "thesis",
        description="initial model. thesis: drawn once from the ranges of the parameters; "
        "informed: the best of many draws on the training crops, and for a CNN Fisher's "
        "discriminant between the surroundings of tower voxels and other voxels. Only for a "
        "SCENE-Net (thesis 5.3.4): unranged: drawn from N(0, 1); handcrafted: values chosen by "
        "hand, the same for every seed; published: the weights of the code of the thesis",
    )
    epochs: int = Field(
        50,
        ge=0,
        description="passes over the training set; a study may score initial models with 0",
    )
    batch_size: int = Field(8, ge=1, description="crops per step")
    optimiser: Literal["rmsprop", "adam", "sgd"] = Field("rmsprop", description="torch optimiser")
    learning_rate: float = Field(
        0.001, gt=0, le=LARGEST_RATE, description="step size of the optimiser"
    )
    decay: float = Field(
        0.0, ge=0, lt=1, description="share by which the learning rate decreases (5.3.4)"
    )
    decay_every: int = Field(10, ge=1, description="epochs between two decreases")
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
    "cnn": ("protocol", "metric", "search", "geneos", "first"),
    "thesis": ("metric", "search", "n_kernels", "first"),
    "operational": ("training", "kernel_size", "n_kernels"),
}
"""Settings without effect, for a CNN and for a SCENE-Net of each protocol."""


def unused_settings(raw: Mapping[str, Any]) -> tuple[str, ...]:
    """Settings without effect for the ``kind`` and ``protocol`` in ``raw``."""
    return UNUSED.get("cnn" if raw.get("kind") == "cnn" else raw.get("protocol", "thesis"), ())


class ModelSettings(Settings):
    """An architecture and the protocol of its training."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_-]*$", description="name in results and tables")
    kind: Literal["scenenet", "cnn"] = Field(description="architecture")
    target: TargetText = Field(
        TOWER.text,
        description=f"what the model finds: {', '.join(ROLES)}, or class codes with a name "
        "(lamp=14,16)",
    )
    protocol: Protocol = Field(
        "thesis",
        description="thesis: kernels in voxels, trained by gradient (thesis 5.2.1); operational: "
        "a SCENE-Net with kernels in metres, found by a search, for real surveys "
        "(docs/method/operational_protocol.md)",
    )
    metric: MetricSettings = MetricSettings()
    search: SearchSettings = SearchSettings()
    geneos: tuple[Kernel, ...] = Field(
        THESIS_GENEOS, min_length=1, description="kernels of a SCENE-Net; a name may be repeated"
    )
    first: tuple[Kernel, ...] = Field(
        (),
        description="kernels of a first observer, whose probability is the measurement phi of the "
        "others; none: phi is measured in points (docs/method/observers.md)",
    )
    n_kernels: int = Field(3, ge=1, description="kernels of a CNN")
    kernel_size: KernelSize = Field((9, 9, 9), description="(kz, ky, kx) in voxels")
    measurement: MeasurementName = Field(
        PRESENCE,
        description="phi (thesis 4.2.2, 5.3.2; docs/guides/measurements.md)",
        json_schema_extra={"enum": list(IN_WORKFLOW)},
    )
    training: TrainingSettings = TrainingSettings()

    @property
    def finds(self) -> Target:
        """What the model finds."""
        return Target.parse(self.target)

    @property
    def gives_whole_towers(self) -> bool:
        """Whether its answer is whole towers instead of the voxels at or above tau."""
        return self.protocol == "operational" and self.metric.whole_towers

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
            hint = ""
            if "protocol" in without_effect:
                hint = " (training.init: informed lets a cnn start from the training crops)"
            raise ValueError(
                f"{', '.join(without_effect)}: without effect for {what}; remove it{hint}"
            )
        return raw

    @model_serializer(mode="wrap")
    def _effective(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Only the settings with an effect, so that records of a model contain no others. The
        target is left out where it is the tower, and a first observer where there is none, so that
        records of earlier versions stay valid."""
        raw = dump(self)
        usual = {
            *(["target"] if self.finds.is_tower else []),
            *([] if self.first else ["first"]),
        }
        return {name: raw[name] for name in raw if name not in {*unused_settings(raw), *usual}}

    @classmethod
    def after_changes(cls, raw: dict[str, Any], changed: set[str]) -> dict[str, Any]:
        unused = unused_settings(raw)
        return {name: raw[name] for name in raw if name in changed or name not in unused}

    @model_validator(mode="after")
    def _only_towers_are_whole(self) -> Self:
        if self.gives_whole_towers and not self.finds.is_tower:
            raise ValueError(
                f"metric.whole_towers: a model of target {self.target} finds no towers; write "
                "metric: {whole_towers: false}"
            )
        return self

    @model_validator(mode="after")
    def _init_fits(self) -> Self:
        if self.kind == "cnn" and self.training.init in GENEO_INITS:
            raise ValueError(
                f"training.init {self.training.init} is for a SCENE-Net; a CNN has no parameter "
                "ranges"
            )
        if self.training.init == "published" and self.geneos != THESIS_GENEOS:
            raise ValueError(
                f"training.init published: the published weights are those of "
                f"{', '.join(THESIS_GENEOS)}; remove geneos"
            )
        return self


class TuningSettings(Settings):
    """Choices on the validation part, by F0.5 (thesis 5.2.7)."""

    kernel_sizes: tuple[KernelSize, ...] = Field(
        (),
        description="further sizes (kz, ky, kx) at which the kernels of a SCENE-Net are sampled; "
        "the size of the training is always tried, and a CNN has no other",
    )
