"""The models that take part in an experiment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import Field, ValidationError

from scenenet.core.settings import Settings, changed
from scenenet.models.settings import ModelSettings


class Contender(Settings):
    """A model of the configuration, with other settings if wanted."""

    model: str = Field(description="name of the model")
    changes: dict[str, Any] = Field(
        default_factory=dict,
        description="dotted settings of the model and their values: training.learning_rate",
    )
    name: str | None = Field(None, description="its name in tables; null for the name of the model")


def contenders(
    chosen: Sequence[Contender], models: Sequence[ModelSettings], place: str
) -> list[ModelSettings]:
    """The settings of the models that take part, each with its name in tables.

    Args:
        chosen: the contenders; if empty, every model takes part unchanged.
        models: of the configuration.
        place: the setting, for messages.

    Raises:
        ValueError: a model or a setting does not exist, or two contenders have the same name.
    """
    if not chosen:
        return list(models)
    known = {model.name: model for model in models}
    found = []
    for one in chosen:
        if one.model not in known:
            raise ValueError(f"{place}: {one.model!r} is not one of the models")
        try:
            changes = {**one.changes, "name": one.name or one.model}
            found.append(changed(known[one.model], changes))
        except ValidationError as error:
            raise ValueError(f"{place}, {one.model}: {fault_of(error)}") from None
    names = [model.name for model in found]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"{place}: {', '.join(twice)} is listed more than once")
    return found


def fault_of(error: ValidationError) -> str:
    """The first wrong setting and what is wrong with it."""
    fault = error.errors()[0]
    setting = ".".join(map(str, fault["loc"]))
    return f"{setting}: {fault['msg']}" if setting else fault["msg"]
