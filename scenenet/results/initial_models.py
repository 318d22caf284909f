"""The initial model of a training (thesis 4.4, 5.2.1)."""

from __future__ import annotations

import copy
import sys
from typing import TYPE_CHECKING, NamedTuple

from pydantic import ValidationError

from scenenet.models.settings import ModelSettings
from scenenet.results.seed_result import SeedResult, parameter_columns

if TYPE_CHECKING:
    from scenenet.models.base import VoxelModel

DRAWN = "drawn from the seed at the start of training"
FIRST_STEP = "after the first step of training, the earliest that is recorded"


class InitialModel(NamedTuple):
    """A model at the start of its training.

    Attributes:
        model: the model.
        origin: how its parameters are known: ``DRAWN`` or ``FIRST_STEP``, for captions.
    """

    model: VoxelModel
    origin: str


def initial_model(result: SeedResult, trained: VoxelModel) -> InitialModel | None:
    """The model at the start of one training; None if it is unknown.

    Initial parameters of the thesis protocol follow from the seed alone and are drawn again. Those
    of a search, or of an initialisation that uses the data, cannot be drawn again: the first row of
    the training history is used instead.

    Args:
        result: the training.
        trained: the trained model; the kernels of the initial model are sampled at its size.
    """
    from scenenet.models.factory import new_model
    from scenenet.models.geneo_model import GeneoModel
    from scenenet.models.scenenet import SceneNet

    settings = _settings(result)
    if settings is not None and (
        settings.training.init == "thesis"
        and (settings.protocol == "thesis" or settings.kind == "cnn")
    ):
        drawn = new_model(settings, result.seed)
        if isinstance(drawn, SceneNet):
            drawn = drawn.with_kernel_size(trained.kernel_size)
        return InitialModel(drawn, DRAWN)
    if not isinstance(trained, GeneoModel) or result.history is None or result.history.empty:
        return None
    names = parameter_columns(result.history)
    numbers = {name: float(result.history[name].iloc[0]) for name in names}
    known = trained.shape_parameters()
    if not known.keys() <= numbers.keys():
        return None
    first = copy.deepcopy(trained)
    first.set_shape_parameters({name: numbers[name] for name in known})
    return InitialModel(first, FIRST_STEP)


def _settings(result: SeedResult) -> ModelSettings | None:
    """The settings of a training; None if its record has none, or settings that this version
    refuses, which are reported on stderr."""
    recorded = (result.provenance or {}).get("settings")
    if not recorded:
        return None
    try:
        return ModelSettings.model_validate(recorded)
    except ValidationError as error:
        fault = error.errors()[0]
        place = ".".join(map(str, fault["loc"])) or "settings"
        print(
            f"{result.model} seed {result.seed}: the recorded settings are not those of this "
            f"version, so its initial parameters cannot be drawn again ({place}: {fault['msg']})",
            file=sys.stderr,
        )
        return None
