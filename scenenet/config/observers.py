"""The settings of observers: models of other targets than towers, which predict beside a tower
model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

from pydantic import Field, ValidationError, model_validator

from scenenet.core.settings import Settings, changed
from scenenet.dataset.split import SplitSettings
from scenenet.dataset.square_settings import SquareSettings
from scenenet.dataset.voxels import LARGEST_VOXEL, SMALLEST_VOXEL, VoxelSettings
from scenenet.measurement.registry import PRESENCE
from scenenet.models.settings import ModelSettings, TargetText
from scenenet.pointcloud.targets import ROLES, Target
from scenenet.training import presets

OTHER_VOXEL_M = 1.0
"""m, voxel size of the crops of a target that has none of its own."""


class ObserverSettings(Settings):
    """A SCENE-Net of another target than the tower, trained as ``scenenet train --target`` does."""

    name: str = Field(
        pattern=ModelSettings.model_fields["name"].metadata[0].pattern,
        description="name in results and tables",
    )
    target: TargetText = Field(
        description=f"what it finds: {', '.join(name for name in ROLES if name != 'tower')}, or "
        "class codes with a name (lamp=14,16)"
    )
    voxel_size: float | None = Field(
        None,
        ge=SMALLEST_VOXEL,
        le=LARGEST_VOXEL,
        description="m, edge of a voxel of its crops; null for that of scenenet train --target: "
        + ", ".join(f"{size:g} for {name}" for name, size in presets.VOXEL_SIZES.items())
        + f", and {OTHER_VOXEL_M:g} for others",
    )
    square: SquareSettings = SquareSettings()
    split: SplitSettings | None = Field(
        None, description="shares of its squares; null for those of `split`"
    )
    changes: Mapping[str, Any] = Field(
        {},
        description="settings of its model, by dotted name as in `models`, that differ from those "
        "of scenenet train --target, such as search.starts or geneos",
    )

    @property
    def finds(self) -> Target:
        """What it finds."""
        return Target.parse(self.target)

    def model(self) -> ModelSettings:
        """The settings of its model.

        Raises:
            ValidationError: ``changes`` names no setting, or a value that is not allowed.
        """
        usual = presets.preset("scenenet", "operational", target=self.finds)
        return changed(usual, {"name": self.name, **self.changes})

    def grid(self) -> VoxelSettings:
        """The grid of its crops."""
        size = self.voxel_size or presets.voxel_size("scenenet", "operational", self.finds)
        return VoxelSettings(fit="metric", voxel_size=size or OTHER_VOXEL_M)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.finds.is_tower:
            raise ValueError("target tower: models of towers stand in models; move it there")
        if fixed := {"name", "target", "kind"} & set(self.changes):
            raise ValueError(f"changes: {', '.join(sorted(fixed))} cannot be changed; remove it")
        try:
            model = self.model()
        except ValidationError as error:
            faults = [
                f"{'.'.join(map(str, fault['loc']))}: {fault['msg'].removeprefix('Value error, ')}"
                for fault in error.errors()
            ]
            raise ValueError(f"changes: {'; '.join(faults)}") from None
        if model.measurement != PRESENCE:
            raise ValueError(
                f"changes: measurement {model.measurement}: an observer of the workflow measures "
                f"{PRESENCE}; train others with scenenet train --measurement"
            )
        return self


def predicting(
    names: Sequence[str], observers: Sequence[ObserverSettings]
) -> list[ObserverSettings]:
    """The observers that predict, in the order of ``names``.

    Raises:
        ValueError: a name is that of no observer, or two of them have one target.
    """
    known = {observer.name: observer for observer in observers}
    if unknown := [name for name in names if name not in known]:
        raise ValueError(
            f"predict.observers: {', '.join(unknown)} is not one of the observers: "
            f"{', '.join(known) or 'there are none'}"
        )
    chosen = [known[name] for name in names]
    targets: dict[str, str] = {}
    for observer in chosen:
        if (other := targets.setdefault(observer.finds.name, observer.name)) != observer.name:
            raise ValueError(
                f"predict.observers: {other} and {observer.name} both find "
                f"{observer.finds.name}; name one of them"
            )
    if len(set(names)) < len(names):
        raise ValueError(f"predict.observers: {', '.join(names)} lists an observer twice")
    return chosen
