"""Settings of prediction."""

from __future__ import annotations

from pydantic import Field

from scenenet.core.settings import Settings


class PredictSettings(Settings):
    """Prediction of a survey."""

    voxel_size: float | None = Field(
        None,
        gt=0,
        description="m; null for the voxel size of the training. A model in metres observes finer "
        "voxels in blocks of about a metre",
    )
    chunk_points: int = Field(
        1_000_000, ge=1, description="points read at once; memory grows with it"
    )
