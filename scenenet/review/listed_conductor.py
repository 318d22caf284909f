"""A conductor of a survey, as the GeoPackage of a prediction or the prediction itself has it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True)
class ListedConductor:
    """A conductor of a survey.

    Attributes:
        span_id, conductor_id: its numbers in its prediction.
        xyz: (n, 3) places along it, in the units of the survey.
        values: column of the list of conductors -> its value.
        rejected: whether the prediction left it out, because people had rejected it.
    """

    span_id: int
    conductor_id: int
    xyz: np.ndarray = field(compare=False)
    values: Mapping[str, Any] = field(default_factory=dict, compare=False)
    rejected: bool = False

    @property
    def key(self) -> tuple[int, int]:
        """Its numbers."""
        return self.span_id, self.conductor_id

    @property
    def middle(self) -> list[float]:
        """x, y and z of its middle, in the units of the survey."""
        n = len(self.xyz)
        return ((self.xyz[(n - 1) // 2] + self.xyz[n // 2]) / 2).tolist()
