"""Settings of the cross-validation."""

from __future__ import annotations

from pydantic import Field

from scenenet.core.settings import Settings
from scenenet.experiments.contenders import Contender


class CrossValidationSettings(Settings):
    """Every crop is a test crop once, for data sets too small for one split."""

    leave_out: int = Field(
        0,
        ge=0,
        description="crops left out at a time, in the order of their names; 0 for no "
        "cross-validation",
    )
    contenders: tuple[Contender, ...] = Field(
        (),
        description="models that take part in addition to the boosted trees; empty for every model",
    )
