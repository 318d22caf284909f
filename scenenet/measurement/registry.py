"""All measurements, by name: those of the package, and those that the user provides."""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from functools import cache
from typing import Annotated

from pydantic import AfterValidator

from scenenet.core.errors import InputError
from scenenet.core.provided_code import MEASUREMENTS
from scenenet.core.running_code import REGISTERED
from scenenet.measurement import kinds, outside
from scenenet.measurement.measurement import Measurement

PRESENCE = "presence"
"""The name of the measurement that is 1 in each occupied voxel."""

_MEASUREMENTS: dict[str, Measurement] = {}


def register(measurement: type[Measurement]) -> type[Measurement]:
    """Class decorator: register ``measurement`` under its ``name``.

    A class in a file from outside the package is kept for ``scenenet.core.running_code``.
    """
    if (registered := REGISTERED.get()) is not None:
        registered.append(measurement)
    else:
        _MEASUREMENTS[measurement.name] = measurement()
    return measurement


@cache
def _discover() -> None:
    """Import every file of ``scenenet.measurement.kinds``, which registers its measurement."""
    for module in pkgutil.iter_modules(kinds.__path__):
        importlib.import_module(f"{kinds.__name__}.{module.name}")


def measurement_names() -> list[str]:
    """The names of all measurements, in alphabetical order. No code from outside is run.

    Raises:
        InputError: a file that the user provides cannot be a measurement.
    """
    return sorted(MEASUREMENTS.known())


def measurement_named(name: str) -> Measurement:
    """The measurement called ``name``; provided code is run when it is first asked for.

    Raises:
        InputError: there is none; the message lists the known names. Or the user provides a file
            that fails.
    """
    _discover()
    if name in _MEASUREMENTS:
        return _MEASUREMENTS[name]
    if (source := MEASUREMENTS.source_named(name)) is not None:
        return outside.load(source)
    raise InputError(
        _unknown(name),
        remedy=f"Name one of them, or provide its file with {MEASUREMENTS.option} or in "
        f"{MEASUREMENTS.variable}",
    )


def _unknown(name: str) -> str:
    names = measurement_names()
    close = difflib.get_close_matches(name, names, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    return f"{name!r} is not one of the measurements {', '.join(names)}{hint}"


def _known(name: str) -> str:
    """Refuse the name of a measurement that there is none of; no code is run."""
    if name not in MEASUREMENTS.known():
        raise ValueError(_unknown(name))
    return name


MeasurementName = Annotated[str, AfterValidator(_known)]
"""The name of a measurement, in settings and model files."""
