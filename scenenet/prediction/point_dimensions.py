"""The dimensions that a prediction adds to the points of a survey."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from scenenet.pointcloud.targets import TOWER, Target

PROBABILITY = "tower_probability"
TOWER_ID = "tower_id"
SPAN_ID, CONDUCTOR_ID = "span_id", "conductor_id"
TOWER_CODE = 15
"""Class code of a tower in the schemes asprs and edp."""


def probability_of(target: Target) -> str:
    """Name of the dimension with the probability of a target."""
    return f"{target.name}_probability"


def share_of(target: Target, geneo: str) -> str:
    """Name of the dimension with the share of a GENEO in the response of the model of a target."""
    return f"share_{geneo}" if target.is_tower else f"{target.name}_{geneo}"


def dimensions_of(target: Target, geneos: Iterable[str]) -> dict[str, tuple[type, str]]:
    """The extra dimensions from the model of a target: name -> (numpy type, description)."""
    dimensions: dict[str, tuple[type, str]] = {
        probability_of(target): (np.float32, _described(target)),
    }
    if target.is_tower:
        dimensions[TOWER_ID] = np.uint32, "id of tower, 0 none"
    shares = {share_of(target, geneo): (np.float32, "share of the response") for geneo in geneos}
    return dimensions | shares


LINE_DIMENSIONS: dict[str, tuple[type, str]] = {
    SPAN_ID: (np.uint32, "number of span, 0 none"),
    CONDUCTOR_ID: (np.uint16, "conductor in its span"),
}
"""The extra dimensions where lines are looked for: name -> (numpy type, description)."""


def _described(target: Target) -> str:
    """At most 22 bytes, which is what LAS and the mark of this package leave."""
    return "probability of a tower" if target == TOWER else f"prob. of {target.name}"
