"""Measurements from outside the package: their code is run, and what it registers is checked."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.provided_code import MEASUREMENTS, CodeSource
from scenenet.core.running_code import run
from scenenet.measurement.measurement import NEEDS, MeasuredVoxels, Measurement
from scenenet.pointcloud.point_fields import PointFields

_TRIED = 64
"""Points and voxels on which a measurement is tried."""


def measurement_of_file(path: str | Path) -> Measurement:
    """The measurement in a file, without providing it to anything else, for its tests.

    Raises:
        InputError: as ``load``, or the file cannot be a measurement.
    """
    return load(MEASUREMENTS.source_of_file(path))


@cache
def load(source: CodeSource) -> Measurement:
    """The measurement of ``source``; its code is run once in a process.

    Raises:
        InputError: the code fails or registers no measurement of this name, or the measurement
            does not do what ``Measurement`` asks for; names the file and the line.
    """
    return run(source, Measurement, _fault)  # type: ignore[type-abstract]


def _fault(measurement: Measurement) -> str | None:
    """Why a measurement cannot be used, as the end of a sentence that begins with it; else None."""
    needs = measurement.needs
    if not isinstance(needs, frozenset) or (wrong := sorted(map(str, needs - {*NEEDS}))):
        given = ", ".join(wrong) if isinstance(needs, frozenset) else repr(needs)
        return f"needs {given}, and it may have needs = frozenset of {', '.join(NEEDS)}"
    try:
        measurement.phi(tried_voxels(measurement))
    except InputError as error:
        return error.problem.removeprefix(f"the measurement {measurement.name!r} ")
    return None


def tried_voxels(measurement: Measurement, seed: int = 0) -> MeasuredVoxels:
    """Voxels of one point each whose fields lie in the whole range that files allow.

    Raises:
        InputError: a value of a point is not in [0, 1].
    """
    rng = np.random.default_rng(seed)
    steps = None
    if measurement.fields:
        points = PointFields.random(_TRIED, measurement.fields, rng)
        steps = measurement.point_steps(points) / np.iinfo(np.uint16).max
    count = rng.integers(1, 100, _TRIED)
    return MeasuredVoxels(
        count,
        steps,
        int(count.max()) if "fullest" in measurement.needs else None,
        np.linspace(0, 500, _TRIED) if "height" in measurement.needs else None,
    )
