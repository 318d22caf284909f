"""The base of SCENE-Nets in voxels and in metres: a convex combination of GENEOs (Eq. 4.1)."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import cast

import numpy as np
import torch
from torch import Tensor, nn

from scenenet.convolution.convolve import convolve, convolve_at_voxels
from scenenet.convolution.occupancy import Occupancy
from scenenet.convolution.orbit import Orbit, strongest, strongest_at_voxels
from scenenet.core.errors import InputError
from scenenet.geneo import GeneoKernel, ShapeParameter, kernel_named
from scenenet.models.base import VoxelModel
from scenenet.models.known_answers import KnownAnswers
from scenenet.models.mixing import mixed
from scenenet.models.settings import Mixing

ROUNDING = 1e-6
"""More than the sum of a few responses is rounded by."""

RespondsAt = Callable[[Occupancy, np.ndarray], Tensor]
"""Gives parts (K, A) of H from grids and some of their voxels (A,)."""


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
        """The sampled kernels, (K, kz, ky, kx), before mixing; those with a direction point along
        x."""

    @abstractmethod
    def unit_of(self, parameter: ShapeParameter) -> str:
        """Unit in which ``shape_parameters`` gives ``parameter``."""

    @abstractmethod
    def length_unit_m(self, voxel_size: float) -> float:
        """Metres in one unit of length of the kernels, on voxels of ``voxel_size`` m."""

    @abstractmethod
    def _assign(self, numbers: Mapping[str, float]) -> None:
        """Store the verified ``numbers`` of ``set_shape_parameters``."""

    def kernel_of(self, name: str) -> GeneoKernel:
        """The kernel behind the GENEO called ``name``."""
        return kernel_named(self.geneos[self.names.index(name)])

    def parameters_of(self, name: str) -> tuple[ShapeParameter, ...]:
        """Shape parameters of the kernel behind the GENEO called ``name``."""
        return self.kernel_of(name).parameters

    @property
    def linear(self) -> bool:
        oriented = any(kernel_named(geneo).oriented for geneo in self.geneos)
        return self.mixes == "convex" and not oriented

    @property
    def mixes(self) -> Mixing:
        """How the answers of its GENEOs become one."""
        return "convex"

    def shape_list(self) -> list[tuple[str, ShapeParameter]]:
        """Each of its own shape parameters, with the name of its GENEO."""
        return [(name, p) for name in self.names for p in self.parameters_of(name)]

    def observer(self) -> tuple[Tensor, None]:
        if not self.linear:
            raise NotImplementedError("a maximum or a product of responses is not one kernel")
        return torch.einsum("k,kzyx->zyx", self.mixing_weights(), self.kernels()), None

    def forward(self, occupancy: Occupancy) -> Tensor:
        if self.linear:
            return super().forward(occupancy)
        return torch.relu(torch.tanh(self.contributions(occupancy).sum(dim=0)))

    def contributions(self, occupancy: Occupancy) -> Tensor:
        """Contribution of each GENEO to the observer, (K, B, D, H, W): lambda_k (g_k * x) where
        they are summed up (``scenenet.models.mixing``).

        The sum over k is H, the observer's response before tanh.
        """
        if self.linear:
            return convolve(occupancy, self.weighted_kernels())
        answers = [
            strongest(occupancy, orbit) if len(orbit) > 1 else convolve(occupancy, orbit[0])
            for orbit in self.orbits()
        ]
        weighted = [w * h for w, h in zip(self.mixing_weights(), answers, strict=True)]
        return mixed(torch.stack(weighted), self.mixes)

    @abstractmethod
    def orbit_of(self, name: str, azimuth: float = 0.0) -> Tensor:
        """The kernels of the GENEO called ``name`` in all its directions, (n, kz, ky, kx), before
        mixing, all turned by ``azimuth`` radians."""

    def orbits(self) -> list[Tensor]:
        """The kernels of each GENEO in all its directions."""
        return [self.orbit_of(name) for name in self.names]

    def responder(self, known: KnownAnswers | None = None) -> Callable[[Occupancy], Tensor]:
        if self.linear:
            kernels = self.weighted_kernels().detach()
            return lambda occupancy: self.responses(occupancy, kernels)
        # Without a caller that knows its grids, each of them is seen once.
        known = KnownAnswers().of_kernels() if known is None else known
        weights, own = self.mixing_weights().detach(), tuple(self.names)
        state = (self.voxel_size, *self.numbers()[: len(self.shape_list())])
        orbits = known.kernels(own, state, lambda: [_stored(kernels) for kernels in self.orbits()])

        def parts(occupancy: Occupancy) -> Tensor:
            answers = known.answers(own, state, occupancy, lambda: _answers(orbits, occupancy))
            return mixed(weights[:, None] * answers, self.mixes)

        return parts

    def responder_at(self, *, above_zero: bool = False) -> RespondsAt:
        """As ``responder``, for the voxels at some positions (A,), ascending, as
        ``Occupancy.flat`` numbers them; without cross-sections.

        Args:
            above_zero: whether only responses above 0 are wanted. Operators that can only lower the
                sum are then not asked where it is below 0 already, and it stays below 0 there.
        """
        weights, mixes = self.mixing_weights().detach(), self.mixes
        orbits = self.orbits()
        stored = [_stored(kernels) for kernels in orbits]
        lowering = [bool(kernels.max() <= 0) for kernels in orbits]
        # An orbit takes longer than a single kernel.
        order = sorted(range(len(orbits)), key=lambda k: (lowering[k], len(orbits[k])))
        spare = above_zero and mixes == "convex" and bool((weights >= 0).all())

        def parts(occupancy: Occupancy, at: np.ndarray) -> Tensor:
            answers = torch.zeros((len(stored), len(at)), dtype=weights.dtype)
            for k in order:
                rows = np.arange(len(at))
                if spare and lowering[k]:
                    rows = np.flatnonzero(answers.sum(dim=0).numpy() >= -ROUNDING)
                answer = _answers([stored[k]], occupancy, at[rows])[0]
                answers[k, torch.from_numpy(rows)] = weights[k] * answer
            return mixed(answers, mixes)

        return parts

    def weighted_kernels(self) -> Tensor:
        """lambda_k g_k, (K, kz, ky, kx): the kernels whose sum is the observer's."""
        return self.mixing_weights()[:, None, None, None] * self.kernels()

    def stages(self) -> list[tuple[str, GeneoModel]]:
        """The observers that it is composed of, each with the prefix of the names of its numbers:
        itself, without a prefix, and then those whose answers it measures."""
        return [("", self)]

    def shape_parameters(self) -> dict[str, float]:
        """Every trained number and the derived last mixing weights, by name (``cylinder.r``)."""
        return {
            f"{prefix}{name}": number
            for prefix, model in self.stages()
            for name, number in model._own_numbers().items()
        }

    def _own_numbers(self) -> dict[str, float]:
        numbers = {
            f"{name}.{symbol}": float(value.detach())
            for name in self.names
            for symbol, value in self.shape_of(name).items()
        }
        weights = self.mixing_weights().detach().tolist()
        return numbers | {f"lambda.{n}": w for n, w in zip(self.names, weights, strict=True)}

    def _number_names(self) -> list[str]:
        """The names of ``_own_numbers``."""
        shapes = [f"{name}.{parameter.name}" for name, parameter in self.shape_list()]
        return [*shapes, *(f"lambda.{name}" for name in self.names)]

    def set_shape_parameters(self, numbers: Mapping[str, float]) -> None:
        """Set the numbers that ``shape_parameters`` returns; the last mixing weights are derived.

        Raises:
            InputError: a number is missing, unknown or not finite, or the mixing weights do not
                sum to 1.
        """
        stages = [(prefix, model, model._number_names()) for prefix, model in self.stages()]
        expected = {f"{prefix}{name}" for prefix, _, names in stages for name in names}
        if missing := sorted(expected - numbers.keys()):
            raise InputError(f"parameters are missing: {', '.join(missing)}")
        if unknown := sorted(numbers.keys() - expected):
            raise InputError(f"parameters are unknown: {', '.join(unknown)}")
        for name, number in numbers.items():
            if not abs(number) <= torch.finfo(torch.float32).max:
                raise InputError(f"{name} is {number:g}, not a finite number")
        for prefix, model, names in stages:
            own = {name: numbers[f"{prefix}{name}"] for name in names}
            total = sum(own[f"lambda.{name}"] for name in model.names)
            if abs(total - 1) > 1e-4:
                raise InputError(f"mixing weights sum to {total:.6f}, not to 1")
            model._assign(own)

    def numbers(self) -> np.ndarray:
        """The trained numbers as they are stored, (P,) float64: shapes first, then mixing."""
        return np.array([float(p.detach()) for p in self.parameters()])

    def set_numbers(self, numbers: np.ndarray) -> None:
        """Set what ``numbers`` returns."""
        for parameter, value in zip(self.parameters(), numbers, strict=True):
            parameter.data.fill_(float(value))

    def _stored_shape(self, name: str) -> nn.ParameterDict:
        return cast(nn.ParameterDict, self.shapes[name])


def _stored(kernels: Tensor) -> Orbit | Tensor:
    """An orbit of several kernels by position, a single one (1, kz, ky, kx) as it is."""
    return Orbit.of(kernels) if len(kernels) > 1 else kernels.detach()


def _answers(
    orbits: Sequence[Orbit | Tensor], occupancy: Occupancy, at: np.ndarray | None = None
) -> Tensor:
    """The response of each GENEO at the occupied voxels, (K, M), or at positions ``at`` (A,),
    before mixing."""
    return torch.stack(
        [
            torch.from_numpy(strongest_at_voxels(occupancy, orbit, at))
            if isinstance(orbit, Orbit)
            else convolve_at_voxels(occupancy, orbit, at)[0]
            for orbit in orbits
        ]
    )


def _distinct(names: Sequence[str]) -> list[str]:
    """Names with a number appended to repeated ones: arrow, arrow_2."""
    seen: dict[str, int] = {}
    distinct = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        distinct.append(name if seen[name] == 1 else f"{name}_{seen[name]}")
    return distinct
