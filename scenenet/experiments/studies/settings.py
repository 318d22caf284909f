"""What a study varies, and the settings of each of its trainings."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from scenenet.core.settings import Settings, changed
from scenenet.dataset.split import SplitSettings
from scenenet.dataset.voxels import VoxelSettings
from scenenet.models.settings import KernelSize, ModelSettings


class Variant(Settings):
    """One way to train, by what it changes."""

    name: str = Field(min_length=1, description="how tables and figures call it")
    changes: dict[str, Any] = Field(
        default_factory=dict,
        description="dotted settings and their values: those of a model (training.loss.alpha), of "
        "voxels. and split., and applied.kernel_size, applied.resolution for what is changed "
        "between training and scoring",
    )
    thesis: str | None = Field(
        None, description="entry of the published numbers that it stands beside: ablation.a"
    )


class StudySettings(Settings):
    """A question, and the trainings that answer it."""

    name: str = Field(pattern=r"^[a-z][a-z0-9-]*$", description="name in files and in MLflow")
    title: str = Field(description="heading in the report")
    place: str = Field(description="where the thesis asks the same")
    asks: str = Field(description="the question, as a sentence")
    thesis_says: str | None = Field(None, description="what the thesis found, as a sentence")
    model: str = Field("scenenet", description="name of the model that is varied")
    seeds: tuple[int, ...] = Field((0, 1, 2), min_length=1, description="seeds of every variant")
    part: Literal["validation", "test"] = Field("test", description="crops that are scored")
    common: dict[str, Any] = Field(
        default_factory=dict, description="changes that all variants share, as in variants"
    )
    variants: tuple[Variant, ...] = Field((), description="what is compared")
    vary: dict[str, tuple[Any, ...]] = Field(
        default_factory=dict,
        description="dotted settings and the values of each; every combination is a variant, after "
        "those that are spelt out",
    )

    @model_validator(mode="after")
    def _has_variants(self) -> Self:
        if not self.variants and not self.vary:
            raise ValueError(f"study {self.name}: give variants, or vary, or both")
        names = [variant.name for variant in self.all_variants()]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"study {self.name}: {', '.join(twice)} is there more than once")
        return self

    def all_variants(self) -> tuple[Variant, ...]:
        """The variants, those of ``vary`` last and in the order of its values."""
        combinations = product(*self.vary.values()) if self.vary else ()
        varied = (_named(dict(zip(self.vary, values, strict=True))) for values in combinations)
        return (*self.variants, *varied)

    @property
    def is_grid(self) -> bool:
        """Whether the variants are all combinations of two settings, and nothing else."""
        return len(self.vary) == 2 and not self.variants

    def plans(
        self, model: ModelSettings, voxels: VoxelSettings, split: SplitSettings
    ) -> list[Plan]:
        """The settings of each variant.

        Raises:
            ValueError: a variant changes a setting that does not exist, or to what it cannot be.
        """
        return [
            _plan(
                self.name,
                variant.model_copy(update={"changes": self.common | variant.changes}),
                model,
                voxels,
                split,
            )
            for variant in self.all_variants()
        ]


@dataclass(frozen=True)
class Plan:
    """The settings of a variant.

    Attributes:
        name: of the variant.
        model, voxels, split: what it trains, and on what.
        applied_size: (kz, ky, kx) that the kernels are sampled at after training; None to leave it.
        applied_voxels: grid that it is scored on.
    """

    name: str
    model: ModelSettings
    voxels: VoxelSettings
    split: SplitSettings
    applied_size: KernelSize | None
    applied_voxels: VoxelSettings


def _plan(
    study: str,
    variant: Variant,
    model: ModelSettings,
    voxels: VoxelSettings,
    split: SplitSettings,
) -> Plan:
    groups: dict[str, dict[str, Any]] = {"model": {}, "voxels": {}, "split": {}, "applied": {}}
    for dotted, value in variant.changes.items():
        group, _, rest = dotted.partition(".")
        if group in groups and group != "model" and rest:
            groups[group][rest] = value
        else:
            groups["model"][dotted] = value
    unknown = groups["applied"].keys() - {"kernel_size", "resolution"}
    if unknown:
        raise ValueError(f"study {study}, {variant.name}: applied.{min(unknown)} is no setting")
    try:
        trained = changed(voxels, groups["voxels"])
        size, resolution = (groups["applied"].get(name) for name in ("kernel_size", "resolution"))
        return Plan(
            variant.name,
            changed(model, groups["model"]),
            trained,
            changed(split, groups["split"]),
            None if size is None else changed(model, {"kernel_size": size}).kernel_size,
            trained if resolution is None else changed(trained, {"resolution": resolution}),
        )
    except ValidationError as error:
        fault = error.errors()[0]
        place = ".".join(map(str, fault["loc"]))
        raise ValueError(f"study {study}, {variant.name}: {place}: {fault['msg']}") from None


def _named(changes: dict[str, Any]) -> Variant:
    words = [f"{dotted.rpartition('.')[2]} {_written(value)}" for dotted, value in changes.items()]
    return Variant(name=", ".join(words), changes=changes)


def _written(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "x".join(map(str, value))
    # Written out, as the thesis does: 0.00001 and not 1e-05.
    return f"{value:.12f}".rstrip("0").rstrip(".") if isinstance(value, float) else f"{value}"
