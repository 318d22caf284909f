"""Runs the code of a kernel from outside the package, and checks what it registers.

Only what the user provides is run (``scenenet.core.provided_kernels``), and only when a kernel of
its name is used. A model file makes no code run.
"""

from __future__ import annotations

import hashlib
import linecache
import sys
import traceback
from contextvars import ContextVar
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

import torch

from scenenet.core.errors import InputError
from scenenet.core.provided_kernels import KernelSource, source_of_file
from scenenet.geneo.kernel import GeneoKernel, Lattice, ShapeParameter

REGISTERED: ContextVar[list[type[GeneoKernel]] | None] = ContextVar("registered", default=None)
"""The kernels that the code which is being run registers; None where none is being run."""

_UNITS = ("voxel", "voxel^2", "1")
_SIZE = (7, 5, 5)
"""Voxels (z, y, x) in which a kernel is tried."""


def kernel_of_file(path: str | Path) -> GeneoKernel:
    """The kernel in a file, without providing it to anything else, for its tests.

    Raises:
        InputError: as ``load``, or the file cannot be a kernel.
    """
    return load(source_of_file(path))


@cache
def load(source: KernelSource) -> GeneoKernel:
    """The kernel of ``source``; its code is run once in a process.

    Raises:
        InputError: the code fails or registers no kernel of this name, or the kernel does not do
            what ``GeneoKernel`` asks for; names the file and the line.
    """
    path = source.path
    found: list[type[GeneoKernel]] = []
    token = REGISTERED.set(found)
    try:
        kernel = _of_file(source, found) if source.file else _of_entry(source)
        fault = _fault(kernel)
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        raise _failed(path, error) from error
    finally:
        REGISTERED.reset(token)
    if fault is not None:
        raise InputError(
            f"the kernel {source.name!r} {fault}", file=path, remedy="Correct the kernel file"
        )
    return kernel


def _of_file(source: KernelSource, found: list[type[GeneoKernel]]) -> GeneoKernel:
    path = source.path
    content = path.read_bytes()
    if hashlib.sha256(content).hexdigest() != source.sha256:
        raise InputError("the file was changed while the command ran", file=path, remedy="Repeat")
    module = ModuleType(f"scenenet.geneo.outside.{source.name}")
    module.__file__ = str(path)
    linecache.checkcache(str(path))
    sys.modules[module.__name__] = module
    try:
        exec(compile(content, str(path), "exec"), module.__dict__)
    except BaseException:
        del sys.modules[module.__name__]
        raise
    names = [getattr(kernel, "name", "without a name") for kernel in found]
    if not found:
        raise InputError(
            "the file registers no kernel",
            file=path,
            remedy="Decorate its subclass of GeneoKernel with @register",
        )
    if names != [source.name]:
        raise InputError(
            f"the file registers {', '.join(map(repr, names))}, and a kernel has the name of its "
            f"file, here {source.name!r}",
            file=path,
            remedy="Write each kernel into a file of its own name",
        )
    return found[0]()


def _of_entry(source: KernelSource) -> GeneoKernel:
    module, _, name = (part.strip() for part in (source.entry or "").partition(":"))
    kernel = getattr(import_module(module), name, None) if name else None
    if not (isinstance(kernel, type) and issubclass(kernel, GeneoKernel)):
        raise InputError(
            f"its entry point {source.name!r} must refer to a subclass of GeneoKernel as "
            f"MODULE:CLASS, and refers to {source.entry!r}",
            file=source.where,
            remedy="Correct the entry point in the package",
        )
    if getattr(kernel, "name", None) != source.name:
        raise InputError(
            f"its entry point {source.name!r} refers to a kernel called "
            f"{getattr(kernel, 'name', None)!r}",
            file=source.where,
            remedy="Give the entry point the name of the kernel",
        )
    instance: GeneoKernel = kernel()
    return instance


def _failed(path: Path, error: BaseException) -> InputError:
    """What is wrong with code that raised ``error``, and in which line of ``path``."""
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
    line = error.lineno if isinstance(error, SyntaxError) else (lines[-1] if lines else None)
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    return InputError(
        f"the kernel file fails with {type(error).__name__}: {text}".rstrip(": "),
        file=path,
        place=None if line is None else f"line {line}",
        remedy="Correct the file",
    )


def _fault(kernel: GeneoKernel) -> str | None:
    """Why a kernel cannot be used, as the end of a sentence that begins with it; else None."""
    parameters = getattr(kernel, "parameters", None)
    if not isinstance(parameters, tuple) or not all(
        isinstance(parameter, ShapeParameter) for parameter in parameters
    ):
        return "must have parameters, a tuple of ShapeParameter (one: (ShapeParameter(...),))"
    if not isinstance(kernel.turns, int) or kernel.turns < 1:
        return f"has turns = {kernel.turns!r}, which is no number of turns about z"
    names = [parameter.name for parameter in parameters]
    if len(set(names)) < len(names):
        return f"has two parameters of one name among {', '.join(names)}"
    for parameter in parameters:
        if parameter.unit not in _UNITS:
            return f"has {parameter.name} in {parameter.unit!r}, which is none of {_UNITS}"
        ranges = (parameter.metric_range, parameter.physical_range)
        for low, high in (*ranges, (parameter.low, parameter.high)):
            if not low < high:
                return f"has {parameter.name} from {low:g} to {high:g}, which is no range"
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
