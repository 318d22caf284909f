"""The base of SCENE-Nets in voxels and in metres: a convex combination of GENEOs (Eq. 4.1)."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np
import torch
from torch import Tensor, nn

from scenenet.convolution.convolve import convolve
from scenenet.convolution.occupancy import Occupancy
from scenenet.core.errors import InputError
from scenenet.geneo import Lattice, ShapeParameter, kernel_named
from scenenet.models.base import VoxelModel


class GeneoModel(VoxelModel):
    """A convex combination of GENEO kernels (thesis Eq. 4.1).

    With a cylinder, an arrow and a negative sphere it has eleven trained numbers: nine shape
    parameters and two mixing weights; the third weight is 1 minus the others.

    Attributes:
        geneos: kernel names, which may be repeated.
        names: the same names made distinct: the second arrow is ``arrow_2``.
        shapes, mixing: the trained numbers. A subclass decides how they map to shape parameters
            and mixing weights.
    """

    kind = "scenenet"

    def __init__(self, geneos: Sequence[str], generator: torch.Generator | None) -> None:
        """Draw the parameters at random (thesis 5.2.1).

        Args:
            geneos: kernel names; a name may be repeated (thesis Table 5.5, F and G).
            generator: source of the random numbers; torch's default if None.

        Raises:
            InputError: a kernel is unknown, or ``geneos`` is empty.
        """
        super().__init__()
        if not geneos:
            raise InputError("a SCENE-Net needs at least one GENEO kernel")
        self.geneos = list(geneos)
        self.names = _distinct(self.geneos)
        self.shapes = nn.ModuleDict()
        for name in self.names:
            shape = nn.ParameterDict()
            for parameter in self.parameters_of(name):
                drawn = torch.rand((), generator=generator)
                shape[parameter.name] = nn.Parameter(self._initial_shape(parameter, drawn))
            self.shapes[name] = shape
        self.mixing = nn.ParameterDict()
        for name in self.names[:-1]:
            drawn = torch.rand((), generator=generator)
            self.mixing[name] = nn.Parameter(self._initial_mixing(drawn))

    @abstractmethod
    def _initial_shape(self, parameter: ShapeParameter, drawn: Tensor) -> Tensor:
        """Initial value of the stored number of ``parameter``, from ``drawn`` () in [0, 1)."""

    @abstractmethod
    def _initial_mixing(self, drawn: Tensor) -> Tensor:
        """Initial value of the stored number of a mixing weight, from ``drawn`` () in [0, 1)."""

    @abstractmethod
    def shape_of(self, name: str) -> dict[str, Tensor]:
        """Shape parameters of the GENEO called ``name``, by symbol; differentiable."""

    @abstractmethod
    def mixing_weights(self) -> Tensor:
        """lambda, (K,), sums to 1; differentiable."""

    @abstractmethod
    def kernels(self) -> Tensor:
        """The sampled kernels, (K, kz, ky, kx), before mixing."""

    @abstractmethod
    def unit_of(self, parameter: ShapeParameter) -> str:
        """Unit in which ``shape_parameters`` gives ``parameter``."""

    @abstractmethod
    def length_unit_m(self, voxel_size: float) -> float:
        """Metres in one unit of length of the kernels, on voxels of ``voxel_size`` m."""

    @abstractmethod
    def _assign(self, numbers: Mapping[str, float]) -> None:
        """Store the verified ``numbers`` of ``set_shape_parameters``."""

    def parameters_of(self, name: str) -> tuple[ShapeParameter, ...]:
        """Shape parameters of the kernel behind the GENEO called ``name``."""
        return kernel_named(self.geneos[self.names.index(name)]).parameters

    def observer(self) -> tuple[Tensor, None]:
        return torch.einsum("k,kzyx->zyx", self.mixing_weights(), self.kernels()), None

    def contributions(self, occupancy: Occupancy) -> Tensor:
        """Contribution of each GENEO to the observer, lambda_k (g_k * x), (K, B, D, H, W).

        The sum over k is H, the observer's response before tanh.
        """
        return convolve(occupancy, self.weighted_kernels())

    def weighted_kernels(self) -> Tensor:
        """lambda_k g_k, (K, kz, ky, kx): the kernels whose sum is the observer's."""
        return self.mixing_weights()[:, None, None, None] * self.kernels()

    def shape_parameters(self) -> dict[str, float]:
        """Every trained number and the derived last mixing weight, by name (``cylinder.r``)."""
        numbers = {
            f"{name}.{symbol}": float(value.detach())
            for name in self.names
            for symbol, value in self.shape_of(name).items()
        }
        weights = self.mixing_weights().detach().tolist()
        return numbers | {f"lambda.{n}": w for n, w in zip(self.names, weights, strict=True)}

    def set_shape_parameters(self, numbers: Mapping[str, float]) -> None:
        """Set the numbers that ``shape_parameters`` returns; the last mixing weight is derived.

        Raises:
            InputError: a number is missing, unknown or not finite, or the mixing weights do not
                sum to 1.
        """
        expected = self.shape_parameters()
        if missing := sorted(expected.keys() - numbers.keys()):
            raise InputError(f"parameters are missing: {', '.join(missing)}")
        if unknown := sorted(numbers.keys() - expected.keys()):
            raise InputError(f"parameters are unknown: {', '.join(unknown)}")
        for name, number in numbers.items():
            if not abs(number) <= torch.finfo(torch.float32).max:
                raise InputError(f"{name} is {number:g}, not a finite number")
        total = sum(numbers[f"lambda.{name}"] for name in self.names)
        if abs(total - 1) > 1e-4:
            raise InputError(f"mixing weights sum to {total:.6f}, not to 1")
        self._assign(numbers)

    def numbers(self) -> np.ndarray:
        """The trained numbers as they are stored, (P,) float64: shapes first, then mixing."""
        return np.array([float(p.detach()) for p in self.parameters()])

    def set_numbers(self, numbers: np.ndarray) -> None:
        """Set what ``numbers`` returns."""
        for parameter, value in zip(self.parameters(), numbers, strict=True):
            parameter.data.fill_(float(value))

    def _sampled(self, lattice: Lattice) -> Tensor:
        """The kernels on ``lattice``, (K, kz, ky, kx)."""
        return torch.stack(
            [
                kernel_named(geneo).sample(lattice, self.shape_of(name))
                for name, geneo in zip(self.names, self.geneos, strict=True)
            ]
        )

    def _stored_shape(self, name: str) -> nn.ParameterDict:
        return cast(nn.ParameterDict, self.shapes[name])


def _distinct(names: Sequence[str]) -> list[str]:
    """Names with a number appended to repeated ones: arrow, arrow_2."""
    seen: dict[str, int] = {}
    distinct = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        distinct.append(name if seen[name] == 1 else f"{name}_{seen[name]}")
    return distinct
