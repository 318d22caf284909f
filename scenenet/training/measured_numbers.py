"""Numbers of a SCENE-Net in metres that are measured at the labelled towers of training crops.

F0.5 in voxels of a metre is the same for a body of 0.3 m and one of 0.1 m, so radius and reach are
not searched for (docs/method/numbers.md). Each is the median over the towers of what their points
show.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from scenenet.dataset.voxels import VoxelSample
from scenenet.models.metric_scenenet import MetricSceneNet

FEWEST = 3
"""Towers from which the deviation of a median can be estimated."""


class Measured(NamedTuple):
    """A measured number.

    Attributes:
        value: median over the towers.
        low, high: two standard errors of the median below and above it; the bounds of the number
            for fewer than ``FEWEST`` towers.
    """

    value: float
    low: float
    high: float


def measure(model: MetricSceneNet, samples: Sequence[VoxelSample]) -> dict[str, Measured]:
    """The measured numbers of a model, by name.

    Numbers that no tower shows, such as the reach of towers without crossarms, are left out.
    """
    bounds = {
        f"{name}.{parameter.name}": model.bounds_of(parameter)
        for name in model.names
        for parameter in model.parameters_of(name)
    }
    found = {}
    for label, field in model.measured_numbers().items():
        seen = [getattr(s.shape, field) for s in samples if s.shape is not None]
        values = np.array([value for value in seen if value is not None])
        if len(values):
            found[label] = _median(values, bounds[label])
    return found


def _median(values: np.ndarray, bounds: tuple[float, float]) -> Measured:
    middle = float(np.clip(np.median(values), *bounds))
    if len(values) < FEWEST:
        return Measured(middle, *bounds)
    # 1.48 median absolute deviations are a standard deviation, and a median has 1.25 times the
    # standard error of a mean.
    deviation = 1.4826 * float(np.median(np.abs(values - np.median(values))))
    error = 1.2533 * deviation / math.sqrt(len(values))
    return Measured(middle, middle - 2 * error, middle + 2 * error)


class FreeNumbers:
    """The numbers of a model that a search varies: neither measured nor fixed.

    Attributes:
        model: whose other numbers do not change.
        size: length of a vector of free numbers: at least 2, as the search needs, so that the last
            may have no effect.
    """

    def __init__(self, model: MetricSceneNet, measured: Mapping[str, Measured]) -> None:
        kept = set(measured) | set(model.fixed_numbers())
        names = []
        for prefix, stage in model.stages():
            names += [f"{prefix}{name}.{p.name}" for name, p in stage.shape_list()]
            names += [f"{prefix}lambda.{name}" for name in stage.names[:-1]]
        self.model = model
        self._free = np.array([name not in kept for name in names], bool)
        self.size = max(2, int(self._free.sum()))

    def of(self, numbers: np.ndarray) -> np.ndarray:
        """(..., size) the free ones of ``numbers`` (..., P), ``MetricSceneNet.numbers``."""
        free = numbers[..., self._free]
        missing = self.size - free.shape[-1]
        return np.pad(free, [(0, 0)] * (free.ndim - 1) + [(0, missing)])

    def set(self, free: np.ndarray) -> None:
        """Set the free numbers (size,) of the model."""
        numbers = self.model.numbers()
        numbers[self._free] = free[: int(self._free.sum())]
        self.model.set_numbers(numbers)
