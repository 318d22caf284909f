"""The models that take part in an experiment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import Field, ValidationError

from scenenet.core.settings import Settings, changed
from scenenet.models.settings import ModelSettings


class Contender(Settings):
    """A model of the configuration, perhaps trained otherwise."""

    model: str = Field(description="name of the model")
    changes: dict[str, Any] = Field(
        default_factory=dict,
        description="dotted settings of the model and their values: training.learning_rate",
    )
    name: str | None = Field(None, description="how tables call it; null for the model's name")


def contenders(
    told: Sequence[Contender], models: Sequence[ModelSettings], place: str
) -> list[ModelSettings]:
    """The settings of the models that take part, under the names that tables call them.

    Args:
        told: the contenders; without any, every model takes part as it is.
        models: of the configuration.
        place: what to call the setting in messages.

    Raises:
        ValueError: a model or a setting is not known, or two have the same name.
    """
    if not told:
        return list(models)
    known = {model.name: model for model in models}
    chosen = []
    for one in told:
        if one.model not in known:
            raise ValueError(f"{place}: {one.model!r} is not one of the models")
        try:
            changes = {**one.changes, "name": one.name or one.model}
            chosen.append(changed(known[one.model], changes))
        except ValidationError as error:
            raise ValueError(f"{place}, {one.model}: {_fault(error)}") from None
    names = [model.name for model in chosen]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"{place}: {', '.join(twice)} is there more than once")
    return chosen


def _fault(error: ValidationError) -> str:
    fault = error.errors()[0]
    setting = ".".join(map(str, fault["loc"]))
    return f"{setting}: {fault['msg']}" if setting else fault["msg"]
