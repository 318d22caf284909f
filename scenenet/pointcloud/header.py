"""The header of a LAS or LAZ file, read with plain bytes and checked against the file's size.

Nothing is decoded here and nothing is believed: a count is compared with the bytes that are there
before anybody allocates or loops by it. A header that claims a billion records costs no more time
than an honest one, and a file cut off in transfer is named as such.

Layout of the public header block: ASPRS LAS 1.4 R15, section 2.4 (all numbers little endian).
"""

from __future__ import annotations

import os
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenenet.errors import InputError
from scenenet.pointcloud.compression import Compression, check_chunk_table, read_compression

SIGNATURE = b"LASF"
HEADER_SIZES = {0: 227, 1: 227, 2: 227, 3: 235, 4: 375, 5: 393}
"""Least header size in bytes of LAS 1.x."""
RECORD_LENGTHS = (20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67)
"""Bytes of a point record without extra bytes, by point format 0-10."""
WAVEFORM_FORMATS = frozenset({4, 5, 9, 10})
VLR_HEAD, EVLR_HEAD = 54, 60
FAR = 1e15
"""No coordinate is as large, in whatever unit; float64 could not tell points apart there."""
MAX_PREAMBLE = 256 * 2**20
"""Most bytes of header and VLRs before the first point; no writer comes near, and it is memory."""
COMPRESSED_BIT = 0x80

GET_AGAIN = "Get the file again from where it came from, or repair it with its own software"
REWRITE = "Rewrite it with a LAS tool (pdal translate, las2las), or get it again"


@dataclass(frozen=True)
class Vlr:
    """A variable length record as it stands in the file.

    Attributes:
        user_id: who defined it.
        record_id: which record of theirs.
        raw: the whole record, its 54-byte head included.
    """

    user_id: str
    record_id: int
    raw: bytes

    @property
    def data(self) -> bytes:
        return self.raw[VLR_HEAD:]


@dataclass(frozen=True)
class Evlr:
    """An extended variable length record: where it is, not what it holds (it may be large).

    Attributes:
        user_id: who defined it.
        record_id: which record of theirs.
        start: byte of the file where its 60-byte head begins.
        length: bytes after the head.
    """

    user_id: str
    record_id: int
    start: int
    length: int


@dataclass(frozen=True)
class LasHeader:
    """A checked header.

    Attributes:
        path: the file.
        file_size: bytes.
        raw: the public header block as it stands in the file.
        version: (1, 0) to (1, 5).
        point_format: 0-10.
        record_length: bytes of one (uncompressed) point record.
        n_points: number of points, which the file has room for.
        offset_to_points: byte of the file where the points begin.
        scales, offsets: (3,) float64; coordinate = integer * scale + offset.
        mins, maxs: (3,) float64, the bounding box that the header claims; points may lie outside.
        vlrs: the variable length records that could be read.
        evlrs: the extended ones, waveform data of LAS 1.3 included.
        gap: bytes between the last record and the first point.
        compression: how the points are compressed; None for plain LAS.
        warnings: what is wrong without standing in the way of the points.
    """

    path: Path
    file_size: int
    raw: bytes
    version: tuple[int, int]
    point_format: int
    record_length: int
    n_points: int
    offset_to_points: int
    scales: np.ndarray
    offsets: np.ndarray
    mins: np.ndarray
    maxs: np.ndarray
    vlrs: tuple[Vlr, ...]
    evlrs: tuple[Evlr, ...]
    gap: bytes
    compression: Compression | None
    warnings: tuple[str, ...]

    @property
    def format(self) -> str:
        """``las``, ``laz`` or ``copc`` (a LAZ file whose points are ordered as an octree)."""
        if self.compression is None:
            return "las"
        first = self.vlrs[0] if self.vlrs else None
        is_copc = first is not None and (first.user_id, first.record_id) == ("copc", 1)
        return "copc" if is_copc else "laz"

    @property
    def n_extra_bytes(self) -> int:
        return self.record_length - RECORD_LENGTHS[self.point_format]

    def find(self, user_id: str, record_id: int) -> Vlr | None:
        """The first record of that kind."""
        for vlr in self.vlrs:
            if (vlr.user_id, vlr.record_id) == (user_id, record_id):
                return vlr
        return None


def read_header(path: str | Path) -> LasHeader:
    """Read and check the header of a LAS or LAZ file.

    Raises:
        InputError: the header is not one, contradicts itself, or claims more than the file holds.
    """
    path = Path(path)
    with path.open("rb") as stream:
        size = os.fstat(stream.fileno()).st_size
        head = stream.read(max(HEADER_SIZES.values()))
        minor = _check_start(path, head, size)
        header_size, offset, n_vlrs, format_byte, record_length = struct.unpack_from(
            "<HIIBH", head, 94
        )
        _check_sizes(path, size, minor, header_size, offset)
        point_format, compressed = _point_format(path, format_byte, record_length)
        stream.seek(0)
        preamble = stream.read(offset)
        warnings: list[str] = []
        vlrs, vlr_end = _read_vlrs(preamble, header_size, n_vlrs, warnings)
        evlrs = _read_evlrs(stream, size, minor, head, warnings)
        n_points = _point_count(minor, head, warnings)
        scales, offsets, mins, maxs = _geometry(path, head, n_points, warnings)
        if compressed:
            compression = read_compression(path, vlrs, record_length)
            check_chunk_table(path, stream, size, offset, n_points, compression)
        else:
            compression = None
            _check_room(path, size, offset, n_points, record_length)
    _check_leftover(
        path, size, offset, n_points, record_length, compressed, evlrs, point_format, warnings
    )
    return LasHeader(
        path=path,
        file_size=size,
        raw=preamble[:header_size],
        version=(1, minor),
        point_format=point_format,
        record_length=record_length,
        n_points=n_points,
        offset_to_points=offset,
        scales=scales,
        offsets=offsets,
        mins=mins,
        maxs=maxs,
        vlrs=vlrs,
        evlrs=evlrs,
        gap=preamble[vlr_end:],
        compression=compression,
        warnings=tuple(warnings),
    )


def _check_start(path: Path, head: bytes, size: int) -> int:
    """Check signature and version; returns the minor version."""
    if head[:4] != SIGNATURE:
        raise InputError(
            f"this is not a LAS file: it starts with {head[:4]!r}, not {SIGNATURE!r}",
            file=path,
            remedy=GET_AGAIN,
        )
    if len(head) < HEADER_SIZES[0]:
        raise InputError(
            f"the file is cut off: it has {size} bytes and a LAS header alone has 227",
            file=path,
            remedy=GET_AGAIN,
        )
    major, minor = head[24], head[25]
    if major != 1 or minor not in HEADER_SIZES:
        raise InputError(
            f"its header says LAS {major}.{minor}; versions 1.0 to 1.5 can be read",
            file=path,
            place="byte 24",
            remedy=REWRITE,
        )
    if len(head) < HEADER_SIZES[minor]:
        raise InputError(
            f"the file is cut off: it has {size} bytes and the header of LAS 1.{minor} has "
            f"{HEADER_SIZES[minor]}",
            file=path,
            remedy=GET_AGAIN,
        )
    return minor


def _check_sizes(path: Path, size: int, minor: int, header_size: int, offset: int) -> None:
    if header_size < HEADER_SIZES[minor]:
        raise InputError(
            f"the header says it is {header_size} bytes long, which in LAS 1.{minor} is at least "
            f"{HEADER_SIZES[minor]}: the program that wrote the file did not finish it",
            file=path,
            place="byte 94",
            remedy=REWRITE,
        )
    if offset < header_size or offset > size:
        raise InputError(
            f"the header says the points begin at byte {offset}, but the header ends at byte "
            f"{header_size} and the file at byte {size}",
            file=path,
            place="byte 96",
            remedy=GET_AGAIN if offset > size else REWRITE,
        )
    if offset > MAX_PREAMBLE:
        raise InputError(
            f"the header says that {offset} bytes of records come before the first point; more "
            f"than {MAX_PREAMBLE} are not read",
            file=path,
            place="byte 96",
            remedy=REWRITE,
        )


def _point_format(path: Path, format_byte: int, record_length: int) -> tuple[int, bool]:
    # LASzip marks compression in bit 7. Bit 6 alone or with it was an early trial format.
    compressed = bool(format_byte & COMPRESSED_BIT)
    point_format = format_byte & ~COMPRESSED_BIT
    if point_format >= len(RECORD_LENGTHS):
        raise InputError(
            f"its header says point format {point_format}; formats 0 to 10 can be read",
            file=path,
            place="byte 104",
            remedy=REWRITE,
        )
    if record_length < RECORD_LENGTHS[point_format]:
        raise InputError(
            f"its header says a point has {record_length} bytes, but a point of format "
            f"{point_format} has at least {RECORD_LENGTHS[point_format]}",
            file=path,
            place="byte 105",
            remedy=REWRITE,
        )
    return point_format, compressed


def _name(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("latin-1")


def _read_vlrs(
    preamble: bytes, start: int, claimed: int, warnings: list[str]
) -> tuple[tuple[Vlr, ...], int]:
    """The records between header and points: as many as are claimed and fit."""
    vlrs: list[Vlr] = []
    position = start
    while len(vlrs) < claimed:
        if position + VLR_HEAD > len(preamble):
            break
        length = struct.unpack_from("<H", preamble, position + 20)[0]
        end = position + VLR_HEAD + length
        if end > len(preamble):
            break
        record_id = struct.unpack_from("<H", preamble, position + 18)[0]
        user_id = _name(preamble[position + 2 : position + 18])
        vlrs.append(Vlr(user_id, record_id, preamble[position:end]))
        position = end
    if len(vlrs) < claimed:
        warnings.append(
            f"the header claims {claimed} variable length records, but only {len(vlrs)} fit before "
            "the points; the others are taken as absent"
        )
    return tuple(vlrs), position


def _read_evlrs(stream, size: int, minor: int, head: bytes, warnings: list[str]):
    """The extended records behind the points, as many as are claimed and fit."""
    claims: list[tuple[int, int]] = []
    if minor == 3:  # LAS 1.3 has one at most, the waveform data, and no count
        waveforms = struct.unpack_from("<Q", head, 227)[0]
        claims = [(waveforms, 1)] if 0 < waveforms < size else []
    elif minor >= 4:
        first, count = struct.unpack_from("<QI", head, 235)
        claims = [(first, count)] if count else []
    evlrs: list[Evlr] = []
    for position, count in claims:
        while len(evlrs) < count and 0 < position <= size - EVLR_HEAD:
            stream.seek(position)
            record = stream.read(EVLR_HEAD)
            record_id, length = struct.unpack_from("<HQ", record, 18)
            if position + EVLR_HEAD + length > size:
                break
            evlrs.append(Evlr(_name(record[2:18]), record_id, position, length))
            position += EVLR_HEAD + length
        if len(evlrs) < count and minor >= 4:
            warnings.append(
                f"the header claims {count} extended variable length records, but only "
                f"{len(evlrs)} fit in the file; the others are taken as absent"
            )
    return tuple(evlrs)


def _point_count(minor: int, head: bytes, warnings: list[str]) -> int:
    legacy = struct.unpack_from("<I", head, 107)[0]
    if minor < 4:
        return legacy
    count = struct.unpack_from("<Q", head, 247)[0]
    if legacy not in (0, count):
        warnings.append(
            f"the header gives two point counts, {count} and {legacy} (the older field); "
            f"{count or legacy} is used"
        )
    return count or legacy


def _geometry(path: Path, head: bytes, n_points: int, warnings: list[str]):
    numbers = np.frombuffer(head, "<f8", count=12, offset=131)
    scales, offsets = numbers[:3].copy(), numbers[3:6].copy()
    maxs, mins = numbers[6::2].copy(), numbers[7::2].copy()
    for name, values, place, reach in (
        ("scale", scales, 131, 2.0**31),
        ("offset", offsets, 155, 1.0),
    ):
        wrong = ~(np.abs(values) < FAR / reach) | ((values == 0) & (name == "scale"))
        if n_points and wrong.any():
            raise InputError(
                f"the coordinate {name}s in the header are {values.tolist()}: coordinates cannot "
                "be told from them",
                file=path,
                place=f"byte {place}",
                remedy=REWRITE,
            )
    if n_points and not (np.isfinite([mins, maxs]).all() and (mins <= maxs).all()):
        warnings.append(
            f"the bounding box in the header is not one: {mins.tolist()} to {maxs.tolist()}"
        )
    return scales, offsets, mins, maxs


def _check_room(path: Path, size: int, offset: int, n_points: int, record_length: int) -> None:
    fit = (size - offset) // record_length
    if n_points > fit:
        raise InputError(
            f"the header claims {n_points} points, but the file holds only {fit}: it is cut off, "
            "or its header is wrong",
            file=path,
            remedy=f"Get the whole file again; if {fit} points are all there are, rewrite its "
            "header (pdal translate, las2las)",
        )


def _check_leftover(
    path: Path,
    size: int,
    offset: int,
    n_points: int,
    record_length: int,
    compressed: bool,
    evlrs: tuple[Evlr, ...],
    point_format: int,
    warnings: list[str],
) -> None:
    """Bytes behind the points that nothing accounts for may be points that nobody would read."""
    accounted = sum(EVLR_HEAD + evlr.length for evlr in evlrs)
    # An empty LAZ file has the place of its chunk table and the table: 8 + 8 bytes, and a few more.
    accounted += 32 if compressed else n_points * record_length
    leftover = size - offset - accounted
    if leftover < record_length or point_format in WAVEFORM_FORMATS:
        return
    if n_points == 0:
        raise InputError(
            f"the header claims 0 points, but {size - offset} bytes follow where points would be: "
            "the program that wrote the file did not finish it",
            file=path,
            remedy=REWRITE,
        )
    if not compressed:
        warnings.append(
            f"behind the {n_points} points of the header there are {leftover} more bytes, room for "
            f"{leftover // record_length} points that are not read"
        )
