"""Whether the coordinates of a survey are metres. Voxels, kernels and towers have sizes in metres,
so a survey in degrees is refused, and one in feet is refused or converted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.las.crs import CrsRecord, Unit

DEGREE_STEP = 2e-7
"""Steps this fine only make sense in degrees: 2e-7 degrees are 2 cm, 2e-7 m are less than light's
wavelength."""
FINE_STEP, NARROW = 1e-5, 2.0
"""Steps up to ``FINE_STEP`` are those of degrees if the survey is at most ``NARROW`` wide: 2
degrees are 200 km, but no survey is 2 m wide."""
STEEP = 300.0
"""A narrow survey that is this many times as high as wide is in degrees: one degree is about
100 km. The points of a single pole are at most 100 times as high as wide."""
METRE = "metre"
KNOWN = {METRE: 1.0, "foot": 0.3048, "US survey foot": 1200 / 3937}
"""Unit of length -> its size in m."""
SYMBOLS = {METRE: "m", "foot": "ft", "US survey foot": "US survey ft"}
"""Unit -> what follows a number; others have their name."""
CONVERT = "(pdal translate IN.laz OUT.laz reprojection --filters.reprojection.out_srs=EPSG:CODE)"
"""The command that converts a survey."""
REPROJECT = f"Reproject it to a system with metres on all axes first {CONVERT}"


class NotMetres(NamedTuple):
    """Why the coordinates of a survey are not metres.

    Attributes:
        problem: what they are instead.
        place: what states it; None if the numbers show it.
        remedy: what the user can do.
        is_length: whether they are in another unit of length, which can be converted.
        guessed: whether only the numbers show it, and the file states nothing.
    """

    problem: str
    place: str | None
    remedy: str
    is_length: bool = False
    guessed: bool = False

    def error(self, file: object) -> InputError:
        return InputError(self.problem, file=str(file), place=self.place, remedy=self.remedy)


def not_metres(
    record: CrsRecord,
    mins: Sequence[float],
    maxs: Sequence[float],
    scales: Sequence[float] | None,
) -> NotMetres | None:
    """The reason if coordinates are known not to be metres, else None.

    Args:
        record: what the file states about them.
        mins, maxs: their extent (x, y, z).
        scales: their steps (x, y, z); None if they are not stored in steps.
    """
    crs = record.crs
    place = None if crs is None else f"CRS {crs.name}"
    if crs is not None and crs.is_geographic:
        return NotMetres("the coordinates are in degrees", place, REPROJECT)
    if crs is not None and crs.is_geocentric:
        return NotMetres("the coordinates are geocentric, so z is not the height", place, REPROJECT)
    if record.planar is not None and not record.planar.is_metre:
        return _not_a_metre("coordinates", record.planar)
    if record.vertical is not None and not record.vertical.is_metre:
        return _not_a_metre("heights", record.vertical)
    if crs is not None and len(crs.axis_info) > 2 and crs.axis_info[2].direction == "down":
        return NotMetres("z is a depth, which grows downwards, not a height", place, REPROJECT)
    if crs is None and record.planar is None and look_like_degrees(mins, maxs, scales):
        (west, south), (east, north) = mins[:2], maxs[:2]
        return NotMetres(
            f"it names no coordinate system, and its coordinates look like degrees (x {west:.7g} "
            f"to {east:.7g}, y {south:.7g} to {north:.7g})",
            None,
            f"{REPROJECT}. If they are metres, write them with their coordinate system, or in "
            "steps of 0.001 m",
            guessed=True,
        )
    return None


def _not_a_metre(what: str, unit: Unit) -> NotMetres:
    return NotMetres(
        f"the unit of the {what} is the {unit.name} ({unit.metres:.6g} m), not the metre",
        unit.source,
        REPROJECT,
        is_length=True,
    )


def sizes(record: CrsRecord) -> tuple[float, float, float]:
    """Sizes in m of the units of x, y and z. An unknown unit is the metre, and the unit of z that
    of x and y if the file does not state it, as LAS files have it."""
    planar = 1.0 if record.planar is None else record.planar.metres
    vertical = planar if record.vertical is None else record.vertical.metres
    return planar, planar, vertical


def unit_name(unit: Unit | None) -> str:
    """Name of a unit of length as in ``KNOWN``, else as the file calls it; the metre if unknown."""
    if unit is None:
        return METRE
    same = (name for name, metres in KNOWN.items() if abs(unit.metres - metres) < 1e-9)
    return next(same, unit.name)


def look_like_degrees(
    mins: Sequence[float], maxs: Sequence[float], scales: Sequence[float] | None
) -> bool:
    """Whether coordinates without a system are degrees, according to their range and steps."""
    low, high = np.asarray(mins, float), np.asarray(maxs, float)
    far = np.maximum(np.abs(low), np.abs(high))
    if not (far[:2] <= [180, 180]).all() or far[:2].min() > 90:  # NaN is not in range either
        return False
    step = None if scales is None else max(abs(scale) for scale in scales[:2])
    if step is not None and step <= DEGREE_STEP:
        return True
    width = (high - low)[:2].max()
    if width > NARROW:
        return False
    return (step is not None and step <= FINE_STEP) or bool(0 < width * STEEP < high[2] - low[2])
