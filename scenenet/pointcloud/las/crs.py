"""The coordinate reference system of a LAS file, and the units of its coordinates.

A file can state its system as WKT (record 2112 of ``LASF_Projection``, or of ``liblas`` in older
files) or as GeoTIFF keys (record 34735). WKT has priority, as in LAS 1.4. Heights can have a unit
of their own: the third axis of a compound system, or the GeoTIFF keys 4096 and 4099.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

from scenenet.core.errors import InputError

if TYPE_CHECKING:
    import pyproj

    from scenenet.pointcloud.las.header import Vlr

USERS = ("LASF_Projection", "liblas")
WKT_RECORD, KEYS_RECORD, DOUBLES_RECORD = 2112, 34735, 34736
GEOGRAPHIC, PROJECTED, VERTICAL = 2048, 3072, 4096
"""GeoTIFF keys with the EPSG code of a system."""
MODEL, PROJECTED_MODEL = 1024, 1
"""GeoTIFF key of the kind of system, and its value for a projected one."""
PLANAR_UNIT, PLANAR_UNIT_SIZE, VERTICAL_UNIT = 3076, 3077, 4099
"""GeoTIFF keys with the EPSG code of a unit, or its size in metres."""
USER_DEFINED = 32767
EPSG_SYSTEMS = range(1024, USER_DEFINED)
SAME_UNIT = 1e-9
"""Largest relative difference of the sizes of one unit; the two feet differ by 2e-6."""
FEET_IN_WKT = re.compile(r'UNIT\s*\[\s*"([^"]*(?:foot|feet|ft)[^"]*)"\s*,\s*([0-9.]+)', re.I)
VERTICAL_IN_WKT = re.compile(r"VERT(?:_CS|CS|CRS|ICALCRS)\s*\[", re.I)


class Unit(NamedTuple):
    """A unit of length.

    Attributes:
        name: as the EPSG data set or the file calls it.
        metres: its size, m.
        source: where the file states it, as the start of a message.
    """

    name: str
    metres: float
    source: str

    @property
    def is_metre(self) -> bool:
        return abs(self.metres - 1) < 1e-4


@dataclass(frozen=True)
class CrsRecord:
    """What a file states about its coordinates.

    Attributes:
        crs: the system; None if the file names none, or one that cannot be parsed.
        problems: why a record gave no system or no unit, as sentences.
        planar: unit of x and y; None for degrees or if unknown.
        vertical: unit of z; None if the file does not state it.
        given: whether the system is not from the file but from the user (``with_system``).
    """

    crs: pyproj.CRS | None = None
    problems: tuple[str, ...] = ()
    planar: Unit | None = None
    vertical: Unit | None = None
    given: bool = False


def read_crs(records: Iterable[Vlr]) -> CrsRecord:
    """The system in the records of a file; a broken record is a problem, not an error."""
    ordered = [r for user in USERS for r in records if r.user_id == user]
    problems: list[str] = []
    found = [_of_wkt(r.data, problems) for r in ordered if r.record_id == WKT_RECORD]
    doubles = next((r.data for r in ordered if r.record_id == DOUBLES_RECORD), b"")
    found += [
        _of_keys(_geo_keys(r.data), doubles, problems)
        for r in ordered
        if r.record_id == KEYS_RECORD
    ]
    named = next((record for record in found if record.crs is not None), None)
    vertical = next((record.vertical for record in found if record.vertical), None)
    if named is not None:  # what a worse record lacks does not matter then
        return CrsRecord(named.crs, (), named.planar, vertical)
    planar = next((record.planar for record in found if record.planar), None)
    return CrsRecord(None, tuple(dict.fromkeys(problems)), planar, vertical)


def named_system(text: str) -> pyproj.CRS:
    """The system that a user names, such as ``EPSG:32629``, ``EPSG:32629+5703`` or its WKT.

    Raises:
        InputError: there is no such system, or it has no x and y.
    """
    import pyproj

    try:
        crs = pyproj.CRS(text)
    except pyproj.exceptions.CRSError:
        crs = None
    if crs is None or len(crs.axis_info) < 2:
        raise InputError(
            f"{text!r} is not a coordinate system with x and y",
            remedy="Name one such as EPSG:32629, or EPSG:32629+5703 with heights",
        )
    return crs


def with_system(record: CrsRecord, given: pyproj.CRS) -> CrsRecord:
    """A record, completed by the system that the user names where the file states none.

    A file that states a system without heights takes those of a compound system with the same
    plan.

    Raises:
        InputError: the file states another system or unit.
    """
    named = _of_crs(given, f"CRS {given.name}")
    if record.crs is not None:
        same = same_system(record.crs, given) or (
            same_system(record.crs.to_2d(), given.to_2d())
            and (named.vertical is None or record.vertical is None)
        )
        if not same:
            raise _contradicts(given, record.crs.name)
        if named.vertical is None or record.vertical is not None:
            return record
    for unit, other in ((record.planar, named.planar), (record.vertical, named.vertical)):
        if unit and other and abs(unit.metres / other.metres - 1) > SAME_UNIT:
            raise _contradicts(given, f"the {unit.name} as unit ({unit.source})")
    return replace(
        record,
        crs=given,
        planar=named.planar or record.planar,
        vertical=named.vertical or record.vertical,
        given=True,
    )


def same_system(one: pyproj.CRS | None, other: pyproj.CRS | None) -> bool:
    """Whether two files have the same system; WKT of different versions spells it differently."""
    if one is None or other is None:
        return one is other
    if one == other:
        return True
    code = one.to_epsg()
    if code is not None and code == other.to_epsg():
        return True
    import pyproj

    # A system that was stored as WKT 1 has lost the order of its axes, and with it its code.
    plain, other_plain = (pyproj.CRS.from_wkt(_wkt(crs)) for crs in (one, other))
    return bool(plain == other_plain)


def _contradicts(given: pyproj.CRS, stated: str) -> InputError:
    return InputError(
        f"the file states {stated}, and the system given for it is {given.name}; what a file "
        "states is never overridden",
        remedy="Give none for this file (--crs, or column crs of the survey sheet), or correct its "
        "record first",
    )


def crs_records(crs: pyproj.CRS, point_format: int) -> list[tuple[int, bytes]]:
    """The record of a system for a file of a point format, as (record id, content).

    Point formats 6 to 10 require WKT. For the others, readers expect GeoTIFF keys, which need EPSG
    codes; a system without them is written as WKT too.
    """
    parts = crs.sub_crs_list or [crs]
    codes = [part.to_epsg() for part in parts]
    if point_format >= 6 or None in codes or not parts[0].is_projected:
        return [(WKT_RECORD, _wkt(crs).encode() + b"\0")]
    keys = [(MODEL, PROJECTED_MODEL), *zip((PROJECTED, VERTICAL), codes, strict=False)]
    entries = b"".join(struct.pack("<4H", key, 0, 1, value) for key, value in keys)
    return [(KEYS_RECORD, struct.pack("<4H", 1, 1, 0, len(keys)) + entries)]


def _wkt(crs: pyproj.CRS) -> str:
    """The system as WKT 1, which LAS prescribes, or as WKT 2 if WKT 1 cannot describe it."""
    import pyproj

    try:
        return crs.to_wkt("WKT1_GDAL")
    except pyproj.exceptions.CRSError:
        return crs.to_wkt()


def states_system(records: Iterable[Vlr]) -> bool:
    """Whether a file has any record of a system, understood or not."""
    return any(r.user_id in USERS and r.record_id in (WKT_RECORD, KEYS_RECORD) for r in records)


def _of_wkt(data: bytes, problems: list[str]) -> CrsRecord:
    import pyproj

    text = data.split(b"\0", 1)[0].decode("utf-8", errors="replace").strip()
    if not text:
        return CrsRecord()
    try:
        crs = pyproj.CRS.from_wkt(text)
    except pyproj.exceptions.CRSError:
        problems.append("the coordinate system (WKT record) cannot be parsed")
        return CrsRecord(None, (), *_feet_in(text))
    return _of_crs(crs, f"CRS {crs.name}")


def _feet_in(text: str) -> tuple[Unit | None, Unit | None]:
    """Planar and vertical unit if a broken WKT names feet; a wrong unit must not pass as metres."""
    source = "the WKT record, which cannot be parsed otherwise,"
    start = VERTICAL_IN_WKT.search(text)
    border = start.start() if start else len(text)
    units: list[Unit | None] = []
    for part in (text[:border], text[border:]):
        feet = FEET_IN_WKT.search(part)
        units.append(Unit(feet[1], float(feet[2]), source) if feet else None)
    return units[0], units[1]


def _of_crs(crs: pyproj.CRS, source: str) -> CrsRecord:
    axes = crs.axis_info
    if crs.is_geographic or not axes:
        planar = None
    else:
        planar = Unit(axes[0].unit_name, axes[0].unit_conversion_factor, source)
    vertical = None
    if len(axes) > 2 and not crs.is_geocentric:
        vertical = Unit(axes[2].unit_name, axes[2].unit_conversion_factor, source)
    return CrsRecord(crs, (), planar, vertical)


def _geo_keys(data: bytes) -> Mapping[int, tuple[int, int]]:
    """Key -> (record of the value or 0, value or its position there)."""
    entries: Iterator[tuple[int, int, int, int]] = struct.iter_unpack(
        "<4H", data[8 : len(data) // 8 * 8]
    )
    return {key: (place, value) for key, place, _, value in entries}


def _of_keys(keys: Mapping[int, tuple[int, int]], doubles: bytes, problems: list[str]) -> CrsRecord:
    crs = _system(keys, PROJECTED) or _system(keys, GEOGRAPHIC)
    named = CrsRecord() if crs is None else _of_crs(crs, f"CRS {crs.name}")
    if crs is None:
        problems.append("the coordinate system (GeoTIFF keys) cannot be parsed")
    planar, vertical = named.planar, named.vertical
    if crs is None or not crs.is_geographic:
        planar = _stricter(planar, _unit(keys, PLANAR_UNIT, doubles, problems))
    heights = _system(keys, VERTICAL)
    if heights is not None and heights.is_vertical:
        axis = heights.axis_info[0]
        vertical = Unit(axis.unit_name, axis.unit_conversion_factor, f"CRS {heights.name}")
    vertical = _stricter(vertical, _unit(keys, VERTICAL_UNIT, doubles, problems))
    return CrsRecord(crs, (), planar, vertical)


def _stricter(one: Unit | None, other: Unit | None) -> Unit | None:
    """Of two statements about the same axis the one that is not metres, so that it is refused."""
    known = [unit for unit in (one, other) if unit is not None]
    return next((unit for unit in known if not unit.is_metre), known[0] if known else None)


def _system(keys: Mapping[int, tuple[int, int]], key: int) -> pyproj.CRS | None:
    import pyproj

    place, code = keys.get(key, (0, 0))
    if place != 0 or code not in EPSG_SYSTEMS:
        return None
    try:
        return pyproj.CRS.from_epsg(code)
    except pyproj.exceptions.CRSError:
        return None


def _unit(
    keys: Mapping[int, tuple[int, int]], key: int, doubles: bytes, problems: list[str]
) -> Unit | None:
    place, code = keys.get(key, (0, 0))
    if place != 0 or code == 0:
        return None
    source = f"GeoTIFF key {key}"
    if known := _units().get(code):
        return Unit(known[0], known[1], source)
    at = keys.get(PLANAR_UNIT_SIZE, (0, 0))[1] * 8
    if key == PLANAR_UNIT and PLANAR_UNIT_SIZE in keys and at + 8 <= len(doubles):
        size = struct.unpack_from("<d", doubles, at)[0]
        return Unit(f"unit of {size:g} m", size, source)
    problems.append(f"the unit in {source} has the unknown code {code}")
    return None


@cache
def _units() -> Mapping[int, tuple[str, float]]:
    """EPSG code of a unit of length -> name, size in m."""
    from pyproj.database import get_units_map

    units = get_units_map("EPSG", "linear", allow_deprecated=True).values()
    return {int(unit.code): (unit.name, unit.conv_factor) for unit in units}
