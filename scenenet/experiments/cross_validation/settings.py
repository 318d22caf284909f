"""Settings of the cross-validation."""

from __future__ import annotations

from pydantic import Field

from scenenet.core.settings import Settings
from scenenet.experiments.contenders import Contender


class CrossValidationSettings(Settings):
    """Every crop once a test crop, where crops are too few for one split to say much."""

    leave_out: int = Field(
        0, ge=0, description="crops left out at a time, in the order of their names; 0 for none"
    )
    contenders: tuple[Contender, ...] = Field(
        (), description="models that take part beside the boosted trees; none for every model"
    )
