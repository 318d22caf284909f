"""The coordinate reference system that a LAS file names, and the unit of its coordinates."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scenenet.pointcloud.header import EVLR_HEAD, LasHeader

if TYPE_CHECKING:
    import pyproj

USER = "LASF_Projection"
WKT_RECORD, GEOTIFF_RECORD = 2112, 34735
MAX_WKT = 2**20
"""Bytes of WKT that are looked at; a real one has a few thousand."""
GEOGRAPHIC_KEY, PROJECTED_KEY, PROJECTED_UNIT_KEY = 2048, 3072, 3076
EPSG_CODES = range(1024, 32767)
GEOTIFF_UNITS = {9001: 1.0, 9002: 0.3048, 9003: 1200 / 3937, 9036: 1000.0}
"""EPSG code of a unit of length -> metres."""


@dataclass(frozen=True)
class CrsRecord:
    """What a file says about its coordinates.

    Attributes:
        crs: the system; None where the file names none or one that cannot be understood.
        unit_m: metres in one planar unit of the coordinates; None in degrees, or where unknown.
        problem: why a record that is there gave no system; None where all is well.
    """

    crs: pyproj.CRS | None
    unit_m: float | None
    problem: str | None


def read_crs(header: LasHeader) -> CrsRecord:
    """The system that the header's records name. WKT comes before GeoTIFF keys, as in LAS 1.4."""
    import pyproj

    crs, problem, keys = None, None, {}
    wkt = _payload(header, WKT_RECORD)
    if wkt is not None:
        text = wkt.split(b"\0", 1)[0].decode("utf-8", errors="replace").strip()
        if text:
            try:
                crs = pyproj.CRS.from_wkt(text)
            except pyproj.exceptions.CRSError:
                problem = "the coordinate system (WKT record) cannot be understood"
    geotiff = _payload(header, GEOTIFF_RECORD)
    if crs is None and geotiff is not None:
        keys = _short_keys(geotiff)
        code = keys.get(PROJECTED_KEY, keys.get(GEOGRAPHIC_KEY))
        try:
            crs = pyproj.CRS.from_epsg(code) if code is not None and code in EPSG_CODES else None
        except pyproj.exceptions.CRSError:
            crs = None
        if crs is None:
            told = f"code {code}" if code is not None else "no code"
            problem = problem or f"the coordinate system (GeoTIFF keys, {told}) is not a known one"
        else:
            problem = None
    return CrsRecord(crs, _unit(crs, keys), problem)


def _payload(header: LasHeader, record_id: int) -> bytes | None:
    vlr = header.find(USER, record_id)
    if vlr is not None:
        return vlr.data
    for evlr in header.evlrs:
        if (evlr.user_id, evlr.record_id) == (USER, record_id) and evlr.length <= MAX_WKT:
            with header.path.open("rb") as stream:
                stream.seek(evlr.start + EVLR_HEAD)
                return stream.read(evlr.length)
    return None


def _short_keys(data: bytes) -> dict[int, int]:
    """GeoTIFF keys whose value stands in the directory itself; as many as are whole."""
    entries = struct.iter_unpack("<4H", data[8 : 8 + (len(data) - 8) // 8 * 8])
    return {key: value for key, location, _, value in entries if location == 0}


def _unit(crs: pyproj.CRS | None, keys: dict[int, int]) -> float | None:
    if crs is None or crs.is_geographic:
        return None
    if keys.get(PROJECTED_UNIT_KEY) in GEOTIFF_UNITS:  # may differ from the unit of the EPSG code
        return GEOTIFF_UNITS[keys[PROJECTED_UNIT_KEY]]
    return crs.axis_info[0].unit_conversion_factor if crs.axis_info else None
