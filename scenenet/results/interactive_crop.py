"""A test crop for the 3D view of the report, as a type and as the JSON files under
``results/interactive_crop``."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

VOXEL_ARRAYS = {"zyx": "<i2", "class": "<u1", "tower": "<u1", "steps": "<u2", "whole": "<u1"}
"""Type of the numbers of each array in the file, little-endian."""
SHARES = "<i1"


@dataclass(frozen=True)
class WholeTowerScores:
    """Scores of the voxels of whole towers over the grid; None if one is not defined."""

    precision: float | None
    recall: float | None
    f05: float | None


@dataclass(frozen=True)
class InteractiveCrop:
    """The M occupied voxels of a crop, and what a model predicts for them.

    Attributes:
        crop: its id.
        rank: best, median or worst, by F0.5 over the test crops.
        model, seed: the model that predicts it.
        voxel_size: m, edge of a voxel.
        classes: names of the classes.
        zyx: (M, 3) voxels.
        voxel_class: (M,) indices into ``classes``.
        tower: (M,) labels.
        shares: GENEO -> (M,) per cent of the output; empty for a CNN.
        steps: (M,) number of thresholds that the probability reaches.
        taus: the thresholds.
        true, false: numbers of tower and of other voxels of the grid, empty ones included, that
            reach exactly i of the thresholds, so that scores at any threshold follow without the
            grid.
        tau_step: index of the threshold of the model.
        whole: (M,) voxels of whole towers found at the threshold of the model.
        whole_scores: scores of those.
    """

    crop: str
    rank: str
    model: str
    seed: int
    voxel_size: float
    classes: tuple[str, ...]
    zyx: np.ndarray
    voxel_class: np.ndarray
    tower: np.ndarray
    shares: Mapping[str, np.ndarray]
    steps: np.ndarray
    taus: tuple[float, ...]
    true: tuple[int, ...]
    false: tuple[int, ...]
    tau_step: int
    whole: np.ndarray
    whole_scores: WholeTowerScores

    def to_json(self) -> dict[str, Any]:
        """The content of the file; arrays are little-endian and in base64."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        values = {_KEYS.get(name, name): value for name, value in values.items()}
        for name, kind in VOXEL_ARRAYS.items():
            values[name] = _coded(values[name], kind)
        for name in ("classes", "taus", "true", "false"):
            values[name] = list(values[name])
        values["shares"] = {name: _coded(row, SHARES) for name, row in self.shares.items()}
        values["whole_scores"] = asdict(self.whole_scores)
        return values

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> InteractiveCrop:
        """The crop from the result of ``to_json``.

        Raises:
            KeyError, TypeError: a value is missing or unknown.
        """
        values = dict(data)
        for name, kind in VOXEL_ARRAYS.items():
            values[name] = _decoded(data[name], kind)
        for name in ("classes", "taus", "true", "false"):
            values[name] = tuple(data[name])
        values["zyx"] = values["zyx"].reshape(-1, 3)
        values["voxel_class"] = values.pop("class")
        values["shares"] = {name: _decoded(row, SHARES) for name, row in data["shares"].items()}
        values["whole_scores"] = WholeTowerScores(**data["whole_scores"])
        return cls(**values)


_KEYS = {"voxel_class": "class"}
"""Keys of the file that cannot be names in Python."""


def _coded(array: np.ndarray, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(array, kind).tobytes()).decode("ascii")


def _decoded(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)
