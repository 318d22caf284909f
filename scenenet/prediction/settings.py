"""Settings of prediction."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from scenenet.core.settings import Settings

ClassByte = Annotated[int, Field(ge=0, le=255)]


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
    classify: bool = Field(
        False,
        description="give the points of towers the class code 15, which is a tower in the schemes "
        "asprs and edp; the survey's other codes stay",
    )
    classify_from: tuple[ClassByte, ...] | None = Field(
        None,
        description="class codes that may be replaced; null for every code. Points with another "
        "code keep it",
    )
