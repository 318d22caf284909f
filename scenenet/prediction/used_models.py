"""The models of a prediction: read once, checked together, before anything else is done."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scenenet.core.errors import InputError
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.pointcloud.las.extra_dimensions import TEXT_BYTES
from scenenet.pointcloud.targets import TOWER, WIRE, Target
from scenenet.prediction.point_dimensions import TOWER_CODE, dimensions_of
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.work.tile_predictions import geneo_names
from scenenet.prediction.work.tile_predictor import layer_of, observed_voxel_size
from scenenet.prediction.work.tiling import Layer

if TYPE_CHECKING:
    from scenenet.models.base import VoxelModel
    from scenenet.models.model_file import ModelCard

ModelPaths = str | Path | Sequence[str | Path]
"""A model file, or several for different targets."""


@dataclass(frozen=True)
class UsedModel:
    """A model of a prediction.

    Attributes:
        path: its file.
        model, card: the model and what its file says about it.
        voxel_size: m, edge of the voxels in which it observes the survey.
        code: class code that points taken for its target get with ``PredictSettings.classify``;
            None to keep their codes.
    """

    path: Path
    model: VoxelModel
    card: ModelCard
    voxel_size: float
    code: int | None

    @property
    def target(self) -> Target:
        """What it finds."""
        return self.card.finds

    @property
    def layer(self) -> Layer:
        """The voxels in which it observes the survey."""
        return layer_of(self.card, self.voxel_size)


def finds_lines(models: Iterable[UsedModel]) -> bool:
    """Whether lines follow from what the models find: towers and wires."""
    targets = {used.target.name for used in models}
    return {TOWER.name, WIRE} <= targets


def paths_of(models: ModelPaths) -> list[Path]:
    """The files of one or of several models."""
    return [Path(models)] if isinstance(models, str | Path) else [Path(path) for path in models]


def use_models(
    models: ModelPaths, settings: PredictSettings, scheme: ClassScheme | None = None
) -> tuple[UsedModel, ...]:
    """Read the models of a prediction, the one of towers first.

    Args:
        models: files of models for different targets, each with tau.
        scheme: of the class codes in the survey, by which points of wires get their code; None to
            keep it.

    Raises:
        InputError: a model cannot be used, two have one target, two write the same dimension, or
            the name of a dimension is too long for LAS.
    """
    from scenenet.models.model_file import read_model

    used = []
    for path in paths_of(models):
        model, card = read_model(path)
        card.threshold()  # fail before the work: without tau no voxel is found
        size = observed_voxel_size(model, card, settings)
        used.append(UsedModel(path, model, card, size, code_of_target(card.finds, scheme)))
    _require_different(used)
    return tuple(sorted(used, key=lambda each: not each.target.is_tower))


def code_of_target(target: Target, scheme: ClassScheme | None) -> int | None:
    """Class code that points taken for a target get (``UsedModel.code``); arguments as
    ``use_models``."""
    if target.is_tower:
        return TOWER_CODE
    return scheme.main_code("conductor") if scheme and target.name == WIRE else None


def _require_different(models: Iterable[UsedModel]) -> None:
    """Refuse models whose results could not be distinguished.

    Raises:
        InputError: as ``use_models``.
    """
    targets: dict[str, Path] = {}
    names: dict[str, Path] = {}
    for used in models:
        if (other := targets.setdefault(used.target.name, used.path)) is not used.path:
            raise InputError(
                f"it finds {used.target.name}, and so does {other}",
                file=used.path,
                remedy="Name one model for each target",
            )
        for name in dimensions_of(used.target, geneo_names(used.model)):
            if len(name.encode()) > TEXT_BYTES:
                raise InputError(
                    f"the dimension {name!r} of its points would have {len(name.encode())} bytes, "
                    f"and LAS allows {TEXT_BYTES}",
                    file=used.path,
                    remedy="Train it with a shorter name of the target or of the GENEO",
                )
            if (other := names.setdefault(name, used.path)) is not used.path:
                raise InputError(
                    f"the dimension {name!r} of its points would be that of {other}",
                    file=used.path,
                    remedy="Predict the survey with one of them at a time",
                )
