"""The coordinate reference system of a LAS file, and the unit of its coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import laspy
    import pyproj

USER = "LASF_Projection"
RECORDS = {2112: "WKT record", 34735: "GeoTIFF keys"}
"""Id of a record -> its name. WKT has priority over GeoTIFF keys, as in LAS 1.4."""


@dataclass(frozen=True)
class CrsRecord:
    """What a file states about its coordinates.

    Attributes:
        crs: the system; None if the file names none, or one that cannot be parsed.
        problem: why a record gave no system; None if there is no problem.
    """

    crs: pyproj.CRS | None
    problem: str | None

    @property
    def unit_m(self) -> float | None:
        """Metres in one planar unit of the coordinates; None for degrees or if unknown."""
        return unit_in_metres(self.crs)


def unit_in_metres(crs: pyproj.CRS | None) -> float | None:
    """Metres in one planar unit of a system; None for degrees or if unknown."""
    if crs is None or crs.is_geographic or not crs.axis_info:
        return None
    return crs.axis_info[0].unit_conversion_factor


def in_degrees(
    crs: pyproj.CRS | None,
    mins: Sequence[float],
    maxs: Sequence[float],
    scales: Sequence[float] | None,
) -> bool:
    """Whether coordinates are degrees: according to the CRS or, without one, to steps and range."""
    if crs is not None:
        return bool(crs.is_geographic)
    if scales is None or max(scales[:2]) > 1e-5:
        return False
    return max(map(abs, (mins[0], maxs[0]))) <= 180 and max(map(abs, (mins[1], maxs[1]))) <= 90


def read_crs(header: laspy.LasHeader) -> CrsRecord:
    """The system in the header's records; a broken record is reported in ``problem``, not
    raised."""
    import pyproj

    problem = None
    for record_id, kind in RECORDS.items():
        for records in (header.vlrs, header.evlrs or ()):
            for record in records:
                if (record.user_id, record.record_id) != (USER, record_id):
                    continue
                try:
                    crs = record.parse_crs()
                except (pyproj.exceptions.CRSError, AttributeError):
                    crs = None  # laspy leaves a record that it cannot parse as bytes
                if crs is not None:
                    return CrsRecord(crs, None)
                if getattr(record, "string", None) != "":
                    problem = problem or f"the coordinate system ({kind}) cannot be parsed"
    return CrsRecord(None, problem)
