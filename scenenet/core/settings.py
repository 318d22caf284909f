"""The base of every settings model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict

NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"
"""What a survey may be called: its name becomes a folder."""


class Settings(BaseModel):
    """Settings of one stage: typed, bounded, frozen; an unknown name is refused, not ignored.

    A default is written once, in the model that stands beside the stage it sets.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


S = TypeVar("S", bound=Settings)


def changed(settings: S, changes: Mapping[str, Any]) -> S:
    """``settings`` with dotted ``changes``, checked anew.

    Raises:
        ValidationError: a change names no setting, or is none that it can be.
    """
    raw = settings.model_dump()
    for dotted, value in changes.items():
        *path, last = dotted.split(".")
        place = raw
        for step in path:
            place = place.setdefault(step, {})
        place[last] = value
    return type(settings).model_validate(raw)
