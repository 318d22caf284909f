"""The setting of square crops, apart from the code that cuts them, which loads pandas."""

from __future__ import annotations

from pydantic import Field

from scenenet.core.settings import Settings


class SquareSettings(Settings):
    """Size of a square crop."""

    edge: float = Field(50.0, ge=1, le=1e4, description="edge of a square crop, m")
