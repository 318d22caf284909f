"""The base of every settings model."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"
"""What a survey may be called: its name becomes a folder."""


class Settings(BaseModel):
    """Settings of one stage: typed, bounded, frozen; an unknown name is refused, not ignored.

    A default is written once, in the model that stands beside the stage it sets.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
