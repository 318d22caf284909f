"""The shape of a tower as plain values, for a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from scenenet.detection.ground import Ground
from scenenet.detection.head import Head
from scenenet.detection.profile import Profile
from scenenet.detection.structure import Structure


def to_record(structure: Structure) -> dict[str, Any]:
    """All that says which points are the tower's own, as JSON holds it; without its conductors."""
    ground, head = structure.ground, structure.head
    return {
        "x": float(structure.x),
        "y": float(structure.y),
        "ground": {"elevation": float(ground.elevation), "slope": ground.slope.tolist()},
        "height": float(structure.height),
        "foot": float(structure.foot),
        "along": structure.along.tolist(),
        "profile": {name: float(value) for name, value in asdict(structure.profile).items()},
        "upright": float(structure.upright),
        "head": {
            "shape": head.cells.shape,
            "cells": "".join("01"[cell] for cell in head.cells.ravel().astype(int).tolist()),
            "left": float(head.left),
            "low": float(head.low),
            "thick": float(head.thick),
        },
        "apart": float(structure.apart),
    }


def from_record(data: Mapping[str, Any]) -> Structure:
    """The structure that ``to_record`` gave, equal to the bit, without its conductors."""
    ground, head = data["ground"], data["head"]
    cells = np.array([cell == "1" for cell in head["cells"]], bool).reshape(head["shape"])
    return Structure(
        x=data["x"],
        y=data["y"],
        ground=Ground(ground["elevation"], np.array(ground["slope"])),
        height=data["height"],
        foot=data["foot"],
        along=np.array(data["along"]),
        profile=Profile(**data["profile"]),
        upright=data["upright"],
        head=Head(cells, head["left"], head["low"], head["thick"]),
        spans=(),
        apart=data["apart"],
    )
