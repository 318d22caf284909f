"""The base class of all settings."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict

NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"
"""Pattern of the name of a survey, which becomes the name of a folder."""

LONGEST_NAME, LONGEST_PATH = 255, 4095
"""Bytes that Linux allows in the name of a file and in a path."""
CONTROL = re.compile(r"[\x00-\x1f\x7f]")


def path_fault(text: str) -> str | None:
    """Why ``text`` cannot be a path for the workflow; None if it can."""
    if found := CONTROL.search(text):
        return f"has the control character {found.group()!r}"
    if "{" in text or "}" in text:
        return "has a brace, which Snakemake reads as a wildcard"
    if len(os.fsencode(text)) > LONGEST_PATH:
        return f"has {len(os.fsencode(text))} bytes, more than the {LONGEST_PATH} of a path"
    longest = max(len(os.fsencode(name)) for name in text.split("/"))
    if longest > LONGEST_NAME:
        return f"has a name of {longest} bytes, more than the {LONGEST_NAME} of a file name"
    return None


def _usable_path(text: str) -> str:
    if fault := path_fault(text):
        raise ValueError(f"the path {fault}")
    return text


def _drawable(text: str) -> str:
    if "$" in text:
        raise ValueError("has a '$', which starts a formula in a figure; remove it")
    if found := CONTROL.search(text):
        raise ValueError(f"has the control character {found.group()!r}; remove it")
    return text


PathText = Annotated[str, AfterValidator(_usable_path)]
"""A path in the settings."""
FigureText = Annotated[str, AfterValidator(_drawable)]
"""A text that is drawn in figures."""


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
