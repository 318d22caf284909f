"""Settings of prediction."""

from __future__ import annotations

from pydantic import Field

from scenenet.core.settings import Settings


class PredictSettings(Settings):
    """How a survey is predicted."""

    voxel_size: float | None = Field(
        None,
        gt=0,
        description="m; null for the size the model was trained at. A model in metres sees finer "
        "voxels in blocks of about a metre, and so does the survey then",
    )
    chunk_points: int = Field(
        1_000_000, ge=1, description="points read at once; memory grows with it"
    )
