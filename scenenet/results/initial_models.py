"""What a model was before it was trained (thesis 4.4, 5.2.1)."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, NamedTuple

from pydantic import ValidationError

from scenenet.models.settings import ModelSettings
from scenenet.results.folder import SeedResult, parameter_columns

if TYPE_CHECKING:
    from scenenet.models.base import VoxelModel

DRAWN = "drawn from the seed, as training began with them"
FIRST_STEP = "after the first step of the training, the earliest that is kept"


class Start(NamedTuple):
    """A model as it began, and how that is known, to be said in a caption."""

    model: VoxelModel
    said: str


def start_of(result: SeedResult, trained: VoxelModel) -> Start | None:
    """The model that one training began with.

    The numbers of the thesis' protocol follow from the seed alone and are drawn again. Those of a
    search, and of a start that looks at the data, are not: there the first row of the history
    stands for them. None where neither is known.

    Args:
        trained: what came out, whose kernel size the start is sampled at.
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
        return Start(drawn, DRAWN)
    if not isinstance(trained, GeneoModel) or result.history is None or result.history.empty:
        return None
    names = parameter_columns(result.history)
    numbers = {name: float(result.history[name].iloc[0]) for name in names}
    known = trained.shape_parameters()
    if not known.keys() <= numbers.keys():
        return None
    first = copy.deepcopy(trained)
    first.set_shape_parameters({name: numbers[name] for name in known})
    return Start(first, FIRST_STEP)


def _settings(result: SeedResult) -> ModelSettings | None:
    """What a model was trained with; None where the record of it does not say."""
    recorded = (result.provenance or {}).get("settings", {})
    try:
        return ModelSettings(**recorded)
    except (ValidationError, TypeError):
        return None
