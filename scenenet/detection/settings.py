"""Settings of tower detection."""

from __future__ import annotations

import math

from pydantic import Field

from scenenet.core.settings import Settings


class DetectionSettings(Settings):
    """What makes a tower of detected voxels."""

    look: float = Field(
        0.5,
        gt=0,
        le=1,
        description="of the observer's answer at tau; a tower is looked for where the answer is "
        "this strong. Where it does not reach tau, a tower must have wires towards two sides and "
        "stand free",
    )
    eps: float = Field(
        6.0,
        gt=0,
        description="m, planar; detected voxels nearer than this to an axis belong to it",
    )
    min_voxels: int = Field(
        3, ge=1, description="detected voxels that must stand above one another on an axis"
    )
    min_body: float = Field(
        3.0,
        ge=0,
        description="m from the lowest to the highest of them, a third of the lowest tower: a "
        "tower is detected along its body, a treetop or a roof at one place",
    )
    min_height: float = Field(
        9.0, ge=0, description="m; thesis 5.1.2 has towers from 18 m, wooden poles begin at 9 m"
    )
    foot_radius: float = Field(
        5.0, gt=0, description="m, around the tower, where the ground at its foot is looked for"
    )
    min_upright: float = Field(
        0.75,
        ge=0,
        le=1,
        description="share of the levels from foot to top at which something must stand: a tower "
        "goes all the way down, wires above one another do not",
    )
    crossarm: float = Field(
        0.25,
        gt=0,
        le=1,
        description="of the height; conductors hang at most this far beside the axis",
    )
    min_wire: float = Field(
        0.75,
        ge=0,
        description="of the way from 3 to 20 m off the axis, or to the edge of the data, that "
        "wires must be followed from the head, all directions together; 0 to ask for none. Trees, "
        "cranes, lone poles and roofs have none. Twice as much where tau is not reached",
    )
    min_free: float = Field(
        0.5,
        ge=0,
        le=1,
        description="share of the body at which nothing may touch it where tau is not reached: a "
        "tree under a line has its crown",
    )
    body: float = Field(
        2.1,
        gt=0,
        description="m about the axis, half the mean width of a tower (thesis 5.1.2): whatever "
        "stands there is the tower, detected or not",
    )
    beside_body: float = Field(
        1.0, ge=0, description="m that this goes beyond half the measured width of a wider tower"
    )
    foot: float = Field(
        1.0, ge=0, description="m above the ground; below are the ground and what grows on it"
    )

    def threshold(self, tau: float) -> float:
        """Probability from which voxels are looked at, where tau makes one a tower's."""
        return tau if tau >= 1 else math.tanh(self.look * math.atanh(tau))
