"""The kernels from outside the package: their code is run, and what it registers is checked."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import torch

from scenenet.core.provided_code import KERNELS, CodeSource
from scenenet.core.running_code import run
from scenenet.geneo.kernel import GeneoKernel, Lattice, ShapeParameter

_UNITS = ("voxel", "voxel^2", "1")
_SIZE = (7, 5, 5)
"""Voxels (z, y, x) in which a kernel is tried."""


def kernel_of_file(path: str | Path) -> GeneoKernel:
    """The kernel in a file, without providing it to anything else, for its tests.

    Raises:
        InputError: as ``load``, or the file cannot be a kernel.
    """
    return load(KERNELS.source_of_file(path))


@cache
def load(source: CodeSource) -> GeneoKernel:
    """The kernel of ``source``; its code is run once in a process.

    Raises:
        InputError: the code fails or registers no kernel of this name, or the kernel does not do
            what ``GeneoKernel`` asks for; names the file and the line.
    """
    return run(source, GeneoKernel, _fault)  # type: ignore[type-abstract]


def _fault(kernel: GeneoKernel) -> str | None:
    """Why a kernel cannot be used, as the end of a sentence that begins with it; else None."""
    parameters = getattr(kernel, "parameters", None)
    if not isinstance(parameters, tuple) or not all(
        isinstance(parameter, ShapeParameter) for parameter in parameters
    ):
        return "must have parameters, a tuple of ShapeParameter (one: (ShapeParameter(...),))"
    if not isinstance(kernel.turns, int) or kernel.turns < 1:
        return f"has turns = {kernel.turns!r}, which is not a number of turns about z"
    names = [parameter.name for parameter in parameters]
    if len(set(names)) < len(names):
        return f"has two parameters of one name among {', '.join(names)}"
    for parameter in parameters:
        if parameter.unit not in _UNITS:
            return f"has {parameter.name} in {parameter.unit!r}, which is not one of {_UNITS}"
        ranges = (parameter.metric_range, parameter.physical_range)
        for low, high in (*ranges, (parameter.low, parameter.high)):
            if not low < high:
                return f"has {parameter.name} from {low:g} to {high:g}, which is not a range"
        if min(low for low, _ in ranges) <= 0:
            return f"has {parameter.name} with a bound that is not positive"
    return _fault_of_values(kernel)


def _fault_of_values(kernel: GeneoKernel) -> str | None:
    """The same for the values that it has on small lattices in voxels and in metres."""
    lattices = [
        Lattice.of_size(_SIZE),
        Lattice.of_extent(_SIZE, 2.0, 1.0),
        Lattice.of_extent(_SIZE, 2.0, 1.0, voxel=1.0),
    ]
    if kernel.oriented:
        lattices += [lattice.turned(0.5, max(kernel.slopes)) for lattice in lattices]
    for lattice in lattices:
        shape = {
            p.name: torch.tensor((p.metric_range[0] * p.metric_range[1]) ** 0.5, requires_grad=True)
            for p in kernel.parameters
        }
        values = kernel.sample(lattice, shape)
        if not isinstance(values, torch.Tensor) or tuple(values.shape) != _SIZE:
            got = tuple(values.shape) if isinstance(values, torch.Tensor) else type(values).__name__
            return f"gives {got} for a lattice of {_SIZE}; sample must return (kz, ky, kx)"
        if values.dtype != lattice.z.dtype:
            return f"gives values of {values.dtype} on a lattice of {lattice.z.dtype}"
        if not torch.isfinite(values).all():
            return f"gives values that are not finite for {_listed(shape)}"
        if shape and not values.requires_grad:
            return "gives values that cannot be differentiated in its parameters; use torch only"
    return None


def _listed(shape: dict[str, torch.Tensor]) -> str:
    return ", ".join(f"{name} = {float(value.detach()):.3g}" for name, value in shape.items())
