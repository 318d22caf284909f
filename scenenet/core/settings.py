"""The base class of all settings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict

NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"
"""Pattern of the name of a survey, which becomes the name of a folder."""


class Settings(BaseModel):
    """Settings of one stage: typed, bounded, frozen; an unknown name is an error.

    Each default is written once, in the settings class next to the stage that uses it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @classmethod
    def after_changes(cls, raw: dict[str, Any], changed: set[str]) -> dict[str, Any]:
        """``raw`` without settings that lost their effect through a change of other ones.

        Args:
            changed: names of the settings that were changed, which stay.
        """
        return raw


S = TypeVar("S", bound=Settings)


def changed(settings: S, changes: Mapping[str, Any]) -> S:
    """A copy of ``settings`` with ``changes``, validated.

    Args:
        changes: dotted name of a setting -> its new value.

    Raises:
        ValidationError: a name is not a setting, or a value is not allowed for it.
    """
    raw = settings.model_dump()
    for dotted, value in changes.items():
        *path, last = dotted.split(".")
        place = raw
        for step in path:
            place = place.setdefault(step, {})
        place[last] = value
    named = {dotted.partition(".")[0] for dotted in changes}
    return type(settings).model_validate(settings.after_changes(raw, named))
