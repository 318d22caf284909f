"""The header of a LAS or LAZ file, read with laspy and checked against the size of the file.

laspy trusts a header: a claim of a billion records is a loop of a billion steps, and a truncated
file is read as fewer points without a warning. So numbers that could make laspy loop are checked
before it reads the header, and the claims about the points before it reads them.

Layout of the public header block: ASPRS LAS 1.4 R15, section 2.4 (all numbers little endian).
"""

from __future__ import annotations

import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.las.chunk_table import check_chunks
from scenenet.pointcloud.las.octree import COPC_INFO, check_octree

if TYPE_CHECKING:
    import laspy

HEADER_SIZES = {0: 227, 1: 227, 2: 227, 3: 235, 4: 375, 5: 393}
"""Minor version of LAS 1.x -> least size of its header, bytes."""
VLR_HEAD, EVLR_HEAD = 54, 60
EMPTY_LAZ_BYTES = 32
"""Most bytes after the header of a LAZ file without points: an empty chunk table and its
position."""
FAR = 1e15
"""No coordinate is this large in any unit; float64 could not distinguish points there."""
MAX_RECORDS = 256 * 2**20
"""Most bytes of records before the points, and after them: laspy keeps them in memory."""
GET_AGAIN = "Get the file again from its source, or repair it with the software that wrote it"
REWRITE = "Rewrite it with a LAS tool (pdal translate, las2las), or get it again"


@dataclass(frozen=True)
class Vlr:
    """A variable length record as stored in the file, before laspy interprets it.

    Attributes:
        user_id: who defined it.
        record_id: number of the record for this user.
        description: its text.
        data: its content.
    """

    user_id: str
    record_id: int
    description: bytes
    data: bytes


@dataclass(frozen=True)
class CheckedHeader:
    """A header that agrees with its file.

    Attributes:
        path: the file.
        las: the header as laspy reads it; the file is large enough for its points.
        vlrs: the variable length records, unchanged.
        evlrs: the extended ones after the points, unchanged.
        waveforms_inside: whether waveforms follow the points instead of being in a separate file.
        warnings: defects that do not prevent reading the points.
    """

    path: Path
    las: laspy.LasHeader
    vlrs: tuple[Vlr, ...]
    evlrs: tuple[Vlr, ...]
    waveforms_inside: bool
    warnings: tuple[str, ...]

    @property
    def records(self) -> tuple[Vlr, ...]:
        """All records, in the order of the file."""
        return self.vlrs + self.evlrs

    @property
    def format(self) -> str:
        """``las``, ``laz`` or ``copc`` (a LAZ file whose points are ordered as an octree)."""
        if not self.las.are_points_compressed:
            return "las"
        is_copc = bool(self.vlrs) and (self.vlrs[0].user_id, self.vlrs[0].record_id) == COPC_INFO
        return "copc" if is_copc else "laz"


def read_header(path: str | Path) -> CheckedHeader:
    """Read and check the header of a LAS or LAZ file.

    Raises:
        InputError: the header is invalid, contradicts itself, or claims more than the file
            contains.
    """
    path = Path(path)
    warnings: list[str] = []
    with path.open("rb") as stream:
        size = os.fstat(stream.fileno()).st_size
        head = stream.read(max(HEADER_SIZES.values()))
        minor = _check_version(path, head, size)
        header_size, offset, n_vlrs = _check_places(path, head, size, minor)
        vlrs = _read_vlrs(stream, header_size, offset, n_vlrs, warnings)
        evlrs = _read_evlrs(stream, head, size, minor, warnings)
        las = _read_with_laspy(path, stream, read_evlrs=evlrs is not None)
        _check_geometry(path, las, warnings)
        waveforms = las.start_of_waveform_data_packet_record if minor >= 3 else 0
        waveforms_inside = las.point_format.has_waveform_packet and 0 < waveforms < size
        if waveforms_inside:
            warnings.append(
                "its waveforms are stored inside the file, so no prediction can be added"
            )
        end = las.start_of_first_evlr if las.evlrs else size
        if waveforms_inside and waveforms > las.offset_to_point_data:
            end = min(end, waveforms)
        _check_room(path, las, end, warnings)
        if las.are_points_compressed:
            check_chunks(path, las, stream, size)
            if vlrs and (vlrs[0].user_id, vlrs[0].record_id) == COPC_INFO:
                check_octree(path, las.point_count, vlrs[0].data, stream, size)
    warnings += _about_counts(head, las)
    return CheckedHeader(path, las, vlrs, evlrs or (), waveforms_inside, tuple(warnings))


def _check_version(path: Path, head: bytes, size: int) -> int:
    """Check that the header block is complete; returns the minor version."""
    if len(head) < HEADER_SIZES[0]:
        raise InputError(
            f"the file is truncated: it has {size} bytes, but a LAS header alone has 227",
            file=path,
            remedy=GET_AGAIN,
        )
    major, minor = head[24], head[25]
    if major != 1 or minor not in HEADER_SIZES:
        raise InputError(
            f"the header says LAS {major}.{minor}, but only versions 1.0 to 1.5 can be read",
            file=path,
            place="byte 24",
            remedy=REWRITE,
        )
    return minor


def _check_places(path: Path, head: bytes, size: int, minor: int) -> tuple[int, int, int]:
    """Check the size of the header, the position of the points and the number of records."""
    header_size, offset, n_vlrs = struct.unpack_from("<HII", head, 94)
    if header_size < HEADER_SIZES[minor]:
        raise InputError(
            f"the header says that it has {header_size} bytes, but LAS 1.{minor} needs at least "
            f"{HEADER_SIZES[minor]}: the program that wrote the file did not finish it",
            file=path,
            place="byte 94",
            remedy=REWRITE,
        )
    if not header_size <= offset <= min(size, MAX_RECORDS):
        raise InputError(
            f"the header says that the points start at byte {offset}, but the header ends at byte "
            f"{header_size}, the file at byte {size}, and records of more than {MAX_RECORDS} bytes "
            "are not read",
            file=path,
            place="byte 96",
            remedy=GET_AGAIN if offset > size else REWRITE,
        )
    if n_vlrs * VLR_HEAD > offset:
        raise InputError(
            f"the header claims {n_vlrs} variable length records, but they do not fit in the "
            f"{offset} bytes before the points",
            file=path,
            place="byte 100",
            remedy=REWRITE,
        )
    return header_size, offset, n_vlrs


def _read_vlrs(
    stream: BinaryIO, header_size: int, offset: int, claimed: int, warnings: list[str]
) -> tuple[Vlr, ...]:
    stream.seek(0)
    preamble, at = stream.read(offset), header_size
    vlrs: list[Vlr] = []
    while len(vlrs) < claimed and at + VLR_HEAD <= offset:
        user, record_id, length, text = struct.unpack_from("<2x16sHH32s", preamble, at)
        data = preamble[at + VLR_HEAD : at + VLR_HEAD + length]
        if len(data) < length:
            break
        user_id = user.split(b"\0", 1)[0].decode("latin-1")
        vlrs.append(Vlr(user_id, record_id, text.split(b"\0", 1)[0], data))
        at += VLR_HEAD + length
    if len(vlrs) < claimed:
        warnings.append(
            f"the header claims {claimed} variable length records, but only {len(vlrs)} fit before "
            "the points"
        )
    return tuple(vlrs)


def _read_evlrs(
    stream: BinaryIO, head: bytes, size: int, minor: int, warnings: list[str]
) -> tuple[Vlr, ...] | None:
    """The extended records; None if the file cannot have any, or not those that it claims."""
    if minor < 4:
        return None
    at, count = struct.unpack_from("<QI", head, 235)
    fit = count == 0 or (0 < at <= size - count * EVLR_HEAD and size - at <= MAX_RECORDS)
    evlrs: list[Vlr] = []
    while fit and len(evlrs) < count:
        stream.seek(at)
        record = stream.read(EVLR_HEAD)
        fit = len(record) == EVLR_HEAD
        if fit:
            user, record_id, length, text = struct.unpack("<2x16sHQ32s", record)
            at += EVLR_HEAD + length
            fit = at <= size
        if fit:
            user_id = user.split(b"\0", 1)[0].decode("latin-1")
            evlrs.append(Vlr(user_id, record_id, text.split(b"\0", 1)[0], stream.read(length)))
    if not fit:
        warnings.append(
            f"the header claims {count} extended variable length records, but they do not fit in "
            f"the {size} bytes of the file, or are too large; they are ignored"
        )
        return None
    return tuple(evlrs)


def _read_with_laspy(path: Path, stream: BinaryIO, *, read_evlrs: bool) -> laspy.LasHeader:
    import laspy

    stream.seek(0)
    try:
        header = laspy.LasHeader.read_from(stream, read_evlrs=read_evlrs)
        header.point_format.dtype()  # fails for two dimensions with the same name
    except Exception as error:  # damaged bytes can make laspy raise anything
        raise InputError(
            f"the header cannot be read ({type(error).__name__}: {error})",
            file=path,
            remedy=REWRITE,
        ) from error
    return header


def _check_geometry(path: Path, las: laspy.LasHeader, warnings: list[str]) -> None:
    if not las.point_count:
        return
    for name, values, limit in (
        ("scale", las.scales, FAR / 2**31),
        ("offset", las.offsets, FAR),
    ):
        if not (np.abs(values) < limit).all() or (name == "scale" and (values == 0).any()):
            raise InputError(
                f"the coordinate {name}s in the header are {values.tolist()}, which give no "
                "usable coordinates",
                file=path,
                remedy=REWRITE,
            )
    mins, maxs = las.mins, las.maxs
    if not (np.isfinite([mins, maxs]).all() and (mins <= maxs).all()):
        warnings.append(
            f"the bounding box in the header is invalid: {mins.tolist()} to {maxs.tolist()}"
        )


def _check_room(path: Path, las: laspy.LasHeader, end: int, warnings: list[str]) -> None:
    """Compare the point count with the bytes from the first point to ``end``."""
    room, length, n_points = end - las.offset_to_point_data, las.point_format.size, las.point_count
    if n_points == 0 and room >= EMPTY_LAZ_BYTES + length:
        raise InputError(
            f"the header claims 0 points, but {room} bytes follow in place of points: the "
            "program that wrote the file did not finish it",
            file=path,
            remedy=REWRITE,
        )
    if las.are_points_compressed:
        return
    fit = max(room // length, 0)
    if n_points > fit:
        raise InputError(
            f"the header claims {n_points} points, but the file has room for only {fit}: it is "
            "truncated, or its header is wrong",
            file=path,
            remedy=f"Get the whole file again; if it has only {fit} points, rewrite its "
            "header (pdal translate, las2las)",
        )
    by_return = int(las.number_of_points_by_return.sum())
    if fit > n_points and by_return == fit:
        raise InputError(
            f"the header claims {n_points} points, but the file has room for {fit}, and its "
            f"numbers of points by return sum to {by_return}: the number of points is wrong",
            file=path,
            remedy=REWRITE,
        )
    if fit > n_points:
        warnings.append(
            f"after the {n_points} points of the header there are {room - n_points * length} more "
            f"bytes, room for {fit - n_points} points, which are not read"
        )


def _about_counts(head: bytes, las: laspy.LasHeader) -> list[str]:
    """Contradictions between the counts of the header. The points themselves decide, see
    ``decoder``; some programs that remove points do not update all counts."""
    found = []
    legacy = struct.unpack_from("<I", head, 107)[0]
    if legacy not in (0, las.point_count):
        found.append(
            f"the header has two numbers of points: {legacy} in the field of LAS 1.3 and earlier, "
            f"{las.point_count} in that of LAS 1.4; the second is used"
        )
    by_return = int(las.number_of_points_by_return.sum())
    if by_return > las.point_count:
        found.append(
            f"the numbers of points by return in the header sum to {by_return}, but it claims "
            f"{las.point_count} points"
        )
    return found
