"""What a kernel is: its origin, its parameters, its values, and which GENEO properties it has."""

from __future__ import annotations

import inspect
import sys
from dataclasses import dataclass

import numpy as np
import torch

from scenenet.core.errors import InputError
from scenenet.core.provided_code import KERNELS
from scenenet.geneo import GeneoKernel, ShapeParameter, kernel_named, kernel_names
from scenenet.geneo.sentences import Reference
from scenenet.interpretability.geneo_properties import ROUNDING
from scenenet.interpretability.parameter_sentences import sentence_of
from scenenet.interpretability.workbench.one_kernel import OneKernel

BUILT_IN = "built in"


@dataclass(frozen=True)
class ParameterDescription:
    """One shape parameter of a kernel.

    Attributes:
        name, meaning: as in ``ShapeParameter``.
        unit: ``m``, ``m^2`` or ``1``.
        low, high: its bounds in models in metres, in ``unit``.
        value: in ``unit``, and what it says as a ``sentence``; None where no value is chosen.
    """

    name: str
    unit: str
    low: float
    high: float
    meaning: str
    value: float | None = None
    sentence: str | None = None


@dataclass(frozen=True)
class KernelDescription:
    """A kernel in the list.

    Attributes:
        name: of the kernel.
        responds_to: the first sentence of its file.
        formula: the docstring of its class.
        origin: ``built in``, the path of its file, or a package with its version.
        sums_to_zero: whether every horizontal slice is meant to sum to zero.
        turns, slopes: directions over which the maximum is taken, as in ``GeneoKernel``; 1 and
            (0,) for a kernel without a direction.
        parameters: its shape parameters.
    """

    name: str
    responds_to: str
    formula: str
    origin: str
    sums_to_zero: bool
    turns: int
    slopes: tuple[float, ...]
    parameters: tuple[ParameterDescription, ...]


@dataclass(frozen=True)
class KernelFacts:
    """What is calculated from the values of a kernel, or of its orbit: all its directions.

    Attributes:
        voxel_size: m.
        size: (kz, ky, kx) voxels.
        directions: number of kernels in the orbit.
        total: sum of all values; of an orbit the largest in absolute value.
        slice_sum: the largest |sum| of a horizontal slice.
        sums_to_zero: whether every slice sums to zero, but for rounding.
        l1: sum of the absolute values, of an orbit the largest: the smallest constant of
            non-expansivity; divided by it, the response is a non-expansive operator (thesis
            Eq. 3.2).
        lowest, highest: the smallest and the largest value.
        quarter_turn_error: largest change of a value under a quarter turn about z, as a share of
            the largest value; of an orbit against the kernel that comes closest. 0 is exact
            equivariance under quarter turns.
    """

    voxel_size: float
    size: tuple[int, int, int]
    directions: int
    total: float
    slice_sum: float
    sums_to_zero: bool
    l1: float
    lowest: float
    highest: float
    quarter_turn_error: float

    @classmethod
    def of(cls, orbit: torch.Tensor, voxel_size: float) -> KernelFacts:
        """The facts of sampled kernels (n, kz, ky, kx); n is 1 for one without a direction."""
        k = orbit.double()
        l1 = float(k.abs().sum(dim=(1, 2, 3)).max())
        slice_sum = float(k.sum(dim=(2, 3)).abs().max())
        return cls(
            voxel_size=voxel_size,
            size=(k.shape[1], k.shape[2], k.shape[3]),
            directions=len(k),
            total=max(k.sum(dim=(1, 2, 3)).tolist(), key=abs),
            slice_sum=slice_sum,
            sums_to_zero=slice_sum <= ROUNDING * max(l1, 1),
            l1=l1,
            lowest=float(k.min()),
            highest=float(k.max()),
            quarter_turn_error=_quarter_turn_error(k),
        )


def _quarter_turn_error(orbit: torch.Tensor) -> float:
    """The change of an orbit (n, kz, ky, kx), as in ``KernelFacts``; each side of a kernel is odd,
    and ky is kx."""
    turned = torch.rot90(orbit, 1, (2, 3))
    nearest = [(orbit - one).abs().amax(dim=(1, 2, 3)).min() for one in turned]
    return float(torch.stack(nearest).max()) / (float(orbit.abs().max()) or 1.0)


def describe(name: str) -> KernelDescription:
    """The kernel called ``name``.

    Raises:
        InputError: there is none, or its file fails.
    """
    kernel = kernel_named(name)
    source = KERNELS.source_named(name)
    return KernelDescription(
        name=name,
        responds_to=_first_sentence(kernel),
        formula=inspect.cleandoc(type(kernel).__doc__ or ""),
        origin=BUILT_IN if source is None else source.where,
        sums_to_zero=kernel.sums_to_zero,
        turns=kernel.turns,
        slopes=kernel.slopes,
        parameters=tuple(_parameter(p, p.physical_range) for p in kernel.parameters),
    )


def describe_all() -> tuple[list[KernelDescription], list[InputError]]:
    """All kernels in alphabetical order, and why others cannot be used."""
    errors = list(KERNELS.faults(KERNELS.provided(), packages=True))
    found = []
    for name in kernel_names():
        try:
            found.append(describe(name))
        except InputError as error:
            if str(error) not in map(str, errors):
                errors.append(error)
    return found, errors


def parameters_of(chosen: OneKernel) -> tuple[ParameterDescription, ...]:
    """The parameters of a sampled kernel, with their values and sentences."""
    values = chosen.values
    reference = Reference(step=chosen.voxel_size)
    return tuple(
        _parameter(p, chosen.model.bounds_of(p), values[p.name], sentence_of(p, values, reference))
        for p in chosen.parameters
    )


def side_view(kernel: np.ndarray) -> list[str]:
    """The slice of a kernel (kz, ky, kx) through its axis as text, the highest row first. Each
    value is a number from -9 to 9, in ninths of the largest absolute value; zero is a dot."""
    return _rows(kernel[::-1, (kernel.shape[1] - 1) // 2, :], np.abs(kernel).max())


def top_view(kernel: np.ndarray) -> tuple[int, list[str]]:
    """The horizontal slice (row of z, text as in ``side_view``) with the largest value, north at
    the top."""
    row = int(np.abs(kernel).max(axis=(1, 2)).argmax())
    return row, _rows(kernel[row, ::-1], np.abs(kernel).max())


def _rows(values: np.ndarray, largest: float) -> list[str]:
    ninths = np.round(9 * values / (largest or 1.0)).astype(int)
    # What is not zero but rounds to it keeps its sign.
    small = (ninths == 0) & (np.abs(values) > 1e-3 * largest)
    texts = np.where(ninths == 0, ".", ninths.astype(str))
    texts = np.where(small, np.where(values > 0, "+", "-"), texts)
    return ["".join(f"{text:>3}" for text in row) for row in texts]


def _first_sentence(kernel: GeneoKernel) -> str:
    module = sys.modules.get(type(kernel).__module__)
    text = (module.__doc__ if module else None) or type(kernel).__doc__ or ""
    return " ".join(inspect.cleandoc(text).partition("\n\n")[0].split())


def _parameter(
    parameter: ShapeParameter,
    bounds: tuple[float, float],
    value: float | None = None,
    sentence: str | None = None,
) -> ParameterDescription:
    return ParameterDescription(
        parameter.name, parameter.metric_unit, *bounds, parameter.meaning, value, sentence
    )
