"""All kernels, by name."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from scenenet.core.errors import InputError
from scenenet.geneo import kernels
from scenenet.geneo.kernel import GeneoKernel

_KERNELS: dict[str, GeneoKernel] = {}


def register(kernel: type[GeneoKernel]) -> type[GeneoKernel]:
    """Class decorator: register ``kernel`` under its ``name``.

    Raises:
        ValueError: another class has this name.
    """
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
    """The names of all kernels, in alphabetical order."""
    _discover()
    return sorted(_KERNELS)


def kernel_named(name: str) -> GeneoKernel:
    """The kernel called ``name``.

    Raises:
        InputError: there is none; the message lists the known names.
    """
    _discover()
    try:
        return _KERNELS[name]
    except KeyError:
        raise InputError(
            f"unknown GENEO kernel {name!r}",
            remedy=f"Name one of: {', '.join(kernel_names())}",
        ) from None
