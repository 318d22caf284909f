"""Settings of a study: what it varies, and the settings of each of its trainings."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from scenenet.core.settings import FigureText, Settings, changed
from scenenet.dataset.split import SplitSettings
from scenenet.dataset.voxels import VoxelSettings
from scenenet.models.settings import KernelSize, ModelSettings


class Variant(Settings):
    """One way to train, given by the settings that it changes."""

    name: FigureText = Field(min_length=1, description="name in tables and figures")
    changes: dict[str, Any] = Field(
        default_factory=dict,
        description="dotted settings and their values: of the model (training.loss.alpha), of the "
        "voxels (voxels.resolution), of the split (split.train), or changed between training and "
        "scoring (applied.kernel_size, applied.resolution)",
    )
    thesis: str | None = Field(
        None, description="group of published numbers to compare with, such as ablation.a"
    )


class StudySettings(Settings):
    """A question, and the trainings that answer it."""

    name: str = Field(pattern=r"^[a-z][a-z0-9-]*$", description="name in files and in MLflow")
    title: FigureText = Field(description="heading in the report and title of the figure")
    place: str = Field(description="section or table of the thesis with the same question")
    asks: str = Field(description="the question, as one sentence")
    thesis_says: str | None = Field(None, description="the finding of the thesis, as one sentence")
    model: str = Field("scenenet", description="name of the model whose settings are varied")
    seeds: tuple[int, ...] = Field(
        (0, 1, 2), min_length=1, description="seeds from which every variant is trained"
    )
    part: Literal["validation", "test"] = Field(
        "test", description="crops on which the models are scored"
    )
    common: dict[str, Any] = Field(
        default_factory=dict, description="changes that all variants have in common"
    )
    variants: tuple[Variant, ...] = Field((), description="the ways to train that are compared")
    vary: dict[str, tuple[Any, ...]] = Field(
        default_factory=dict,
        description="dotted settings and the values of each; every combination is a variant, in "
        "addition to those listed in variants",
    )

    @model_validator(mode="after")
    def _has_variants(self) -> Self:
        if not self.variants and not self.vary:
            raise ValueError(f"study {self.name}: give variants, or vary, or both")
        names = [variant.name for variant in self.all_variants()]
        for listed in (names, [f"seed {seed}" for seed in self.seeds]):
            if twice := sorted({name for name in listed if listed.count(name) > 1}):
                raise ValueError(f"study {self.name}: {', '.join(twice)} is listed more than once")
        return self

    def all_variants(self) -> tuple[Variant, ...]:
        """The variants: those of ``variants``, then the combinations of ``vary`` in their order."""
        combinations = product(*self.vary.values()) if self.vary else ()
        varied = (_named(dict(zip(self.vary, values, strict=True))) for values in combinations)
        return (*self.variants, *varied)

    def jobs(self, trainings: int) -> dict[str, tuple[int, ...]]:
        """The seeds of each job, by the name of the job, such as ``seeds-0-3``.

        Args:
            trainings: about how many a job runs; it has all variants of each of its seeds.
        """
        each = max(1, trainings // len(self.all_variants()))
        groups = [self.seeds[first : first + each] for first in range(0, len(self.seeds), each)]
        return {f"seeds-{'-'.join(map(str, dict.fromkeys((s[0], s[-1]))))}": s for s in groups}

    @property
    def is_grid(self) -> bool:
        """Whether the variants are exactly the combinations of two settings."""
        return len(self.vary) == 2 and not self.variants

    def plans(
        self, model: ModelSettings, voxels: VoxelSettings, split: SplitSettings
    ) -> list[Plan]:
        """The settings of each variant.

        Raises:
            ValueError: a variant changes a setting that does not exist, or to an invalid value.
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
        model, voxels, split: settings of the model and of its data.
        applied_size: (kz, ky, kx) at which kernels are sampled after training; None for no change.
        applied_voxels: grid on which the model is scored.
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
        raise ValueError(
            f"study {study}, {variant.name}: there is no setting applied.{min(unknown)}"
        )
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
    # As in the thesis: 0.00001 and not 1e-05.
    return f"{value:.12f}".rstrip("0").rstrip(".") if isinstance(value, float) else f"{value}"
