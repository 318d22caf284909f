"""Settings of tower detection."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pydantic import Field, model_validator

from scenenet.core.settings import Settings


class DetectionSettings(Settings):
    """How towers are found in the probabilities of voxels (docs/method/detection.md)."""

    look: float = Field(
        0.4,
        gt=0,
        le=1,
        description="share of the observer's value at tau from which voxels are detected: tau "
        "differs between seeds by a third, and the rules decide what is a tower. A tower whose "
        "voxels all stay below tau needs twice `min_conductor`",
    )
    eps: float = Field(
        6.0,
        gt=0,
        description="m, planar; detected voxels nearer than this to an axis belong to it",
    )
    min_voxels: int = Field(
        3, ge=1, description="smallest number of detected voxels above one another on an axis"
    )
    min_body: float = Field(
        3.0,
        ge=0,
        description="m from the lowest to the highest of these voxels, a third of the lowest "
        "tower: a tower is detected along its body, a treetop or a roof at one height",
    )
    min_height: float = Field(
        9.0, ge=0, description="m; thesis 5.1.2 has towers from 18 m, wooden poles start at 9 m"
    )
    foot_radius: float = Field(
        5.0, gt=0, description="m around the axis; voxels there show the ground at the foot"
    )
    min_upright: float = Field(
        0.75,
        ge=0,
        le=1,
        description="smallest share of the levels from foot to top with an occupied voxel: the "
        "body of a tower reaches the ground; conductors above one another do not",
    )
    crossarm: float = Field(
        0.25,
        gt=0,
        le=1,
        description="largest distance of a conductor from the axis, as a share of the height",
    )
    min_conductor: float = Field(
        0.75,
        ge=0,
        description="smallest length of conductors that leave the head, all directions together, "
        "as a share of the distance from 3 to 20 m from the axis, or to the edge of the data. 0 "
        "accepts towers without conductors. Trees, cranes, lone poles and roofs have none. Below "
        "tau twice this length is needed",
    )

    @model_validator(mode="before")
    @classmethod
    def _old_names(cls, raw: Any) -> Any:
        if isinstance(raw, Mapping) and "min_wire" in raw:
            raise ValueError("min_wire is now called min_conductor; write min_conductor: instead")
        return raw

    def threshold(self, tau: float) -> float:
        """Probability from which voxels count as detected, for a model with threshold ``tau``."""
        return tau if tau >= 1 else math.tanh(self.look * math.atanh(tau))
