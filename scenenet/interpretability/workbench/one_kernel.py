"""One kernel in metres, as a model of the operational protocol has it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.convolve import convolve_at_voxels
from scenenet.convolution.occupancy import Occupancy
from scenenet.convolution.orbit import Orbit, strongest_at_voxels
from scenenet.core.errors import InputError
from scenenet.geneo import ShapeParameter, kernel_named
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.settings import MetricSettings


class OneKernel:
    """A SCENE-Net in metres with one GENEO, whose weight is 1.

    Attributes:
        name: of the kernel.
        model: the model, sampled at ``voxel_size``.
        voxel_size: m.
    """

    def __init__(
        self,
        name: str,
        values: Mapping[str, float] | None = None,
        voxel_size: float = 1.0,
        metric: MetricSettings | None = None,
    ) -> None:
        """Sample the kernel called ``name``.

        Args:
            values: of shape parameters by name, in metres; the others have the geometric middle
                of their range, or the value that is fixed.
            voxel_size: m.
            metric: the lengths of the kernel; the defaults if None.

        Raises:
            InputError: there is no such kernel or parameter, a value is out of its range, or the
                kernel has too many voxels.
        """
        self.name = name
        self.voxel_size = voxel_size
        model = MetricSceneNet([name], metric)
        given = dict(values or {})
        known = [parameter.name for parameter in self.parameters]
        for unknown in sorted(given.keys() - set(known)):
            raise InputError(
                f"the kernel {name!r} has no parameter {unknown!r}",
                remedy=f"Name one of: {', '.join(known)}" if known else "It has none",
            )
        numbers = {f"lambda.{name}": 1.0}
        for parameter in self.parameters:
            low, high = model.bounds_of(parameter)
            usual = math.sqrt(low * high) if parameter.fixed is None else parameter.fixed
            numbers[f"{name}.{parameter.name}"] = given.get(parameter.name, usual)
        model.set_shape_parameters(numbers)
        self.model = model.at(voxel_size)

    @property
    def parameters(self) -> tuple[ShapeParameter, ...]:
        """The shape parameters of the kernel."""
        return kernel_named(self.name).parameters

    @property
    def values(self) -> dict[str, float]:
        """The values of the shape parameters by name, in ``ShapeParameter.metric_unit``."""
        return {
            name: float(value.detach()) for name, value in self.model.shape_of(self.name).items()
        }

    def sampled(self) -> Tensor:
        """The kernel (kz, ky, kx), float32, axes z (up), y, x; one with a direction points along
        x."""
        with torch.no_grad():
            kernel: Tensor = self.model.kernels()[0]
        return kernel

    @cached_property
    def orbit(self) -> Tensor:
        """The kernel in all its directions, (n, kz, ky, kx); n is 1 for one without a direction."""
        with torch.no_grad():
            return self.model.orbits()[0]

    def answers(self, occupancy: Occupancy) -> np.ndarray:
        """(M,) float32, the response at each occupied voxel: the maximum over the orbit."""
        if len(self.orbit) > 1:
            return strongest_at_voxels(occupancy, self._by_position)
        return convolve_at_voxels(occupancy, self.orbit)[0].numpy()

    @cached_property
    def _by_position(self) -> Orbit:
        return Orbit.of(self.orbit)
