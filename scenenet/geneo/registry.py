"""All kernels, by name: those of the package, and those that the user provides."""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from functools import cache

from scenenet.core.errors import InputError
from scenenet.core.provided_code import KERNELS
from scenenet.core.running_code import REGISTERED
from scenenet.geneo import kernels, outside
from scenenet.geneo.kernel import GeneoKernel

_KERNELS: dict[str, GeneoKernel] = {}


def register(kernel: type[GeneoKernel]) -> type[GeneoKernel]:
    """Class decorator: register ``kernel`` under its ``name``.

    A class in a kernel file from outside the package is kept for ``scenenet.core.running_code``.

    Raises:
        ValueError: another class has this name.
    """
    if (registered := REGISTERED.get()) is not None:
        registered.append(kernel)
        return kernel
    known = _KERNELS.get(kernel.name)
    if known is not None and type(known).__qualname__ != kernel.__qualname__:
        raise ValueError(f"two kernels are called {kernel.name!r}: {type(known)} and {kernel}")
    _KERNELS[kernel.name] = kernel()
    return kernel


@cache
def _discover() -> None:
    """Import every file of ``scenenet.geneo.kernels``, each of which registers its kernel."""
    for module in pkgutil.iter_modules(kernels.__path__):
        importlib.import_module(f"{kernels.__name__}.{module.name}")


def kernel_names() -> list[str]:
    """The names of all kernels, in alphabetical order. No code from outside the package is run.

    Raises:
        InputError: a file that the user provides cannot be a kernel.
    """
    _discover()
    return sorted({*_KERNELS, *KERNELS.provided()})


def is_registered(name: str) -> bool:
    """Whether a kernel of the package, or one that this process has registered, has this name."""
    _discover()
    return name in _KERNELS


def kernel_named(name: str) -> GeneoKernel:
    """The kernel called ``name``; the code of a provided kernel is run when it is first asked for.

    Raises:
        InputError: there is none; the message lists the known names. Or the user provides a file
            that fails.
    """
    _discover()
    if name in _KERNELS:
        return _KERNELS[name]
    if (source := KERNELS.source_named(name)) is not None:
        return outside.load(source)
    names = kernel_names()
    close = difflib.get_close_matches(name, names, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    raise InputError(
        f"unknown GENEO kernel {name!r}{hint}",
        remedy=f"Name one of: {', '.join(names)}, or provide its file with --kernels or in "
        f"{KERNELS.variable}",
    )
