"""Writing an existing survey back with dimensions added, and nothing else changed."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np

from scenenet.errors import InputError
from scenenet.files import atomic
from scenenet.pointcloud.compression import LASZIP_RECORD, LASZIP_USER
from scenenet.pointcloud.extra import RECORD_ID as EXTRA_RECORD
from scenenet.pointcloud.extra import USER as EXTRA_USER
from scenenet.pointcloud.extra import ExtraDimension, extra_dimensions
from scenenet.pointcloud.header import COMPRESSED_BIT, EVLR_HEAD, LasHeader, read_header
from scenenet.pointcloud.kinds import kind_of
from scenenet.pointcloud.las import coordinates, iter_records
from scenenet.pointcloud.records import (
    Dimension,
    Dimensions,
    PointSink,
    checked,
    extra_vlrs,
    is_compressed,
    laszip_vlr,
    new_dimensions,
)
from scenenet.pointcloud.survey import read
from scenenet.pointcloud.write import write_cloud

CHUNK_POINTS = 500_000
Values = Callable[[np.ndarray], Mapping[str, np.ndarray]]
"""(n, 3) coordinates -> (n,) numbers by name."""


def add_dimensions(
    source: str | Path, target: str | Path, names: Mapping[str, Dimension], values: Values
) -> int:
    """Write a survey back with every point and everything it had, and dimensions added.

    Points keep their order, stored integers, scale and offset; header, variable length records,
    CRS, waveform data and all other dimensions are copied as bytes and not interpreted.
    Dimensions that an earlier call added (their description says ``scenenet``) are replaced.
    Memory is bounded by a chunk. A COPC survey comes back as plain LAZ, in the order of its file.

    Args:
        source: the survey: LAS, LAZ, COPC, or a .npy / .pt sample (written as ``write_las`` does).
        target: ``.laz`` (or ``.las``) file; appears whole or not at all; may be ``source``.
        names: name -> numpy type, or (type, description of up to 22 characters).
        values: gets (n, 3) float64 coordinates of consecutive points, returns (n,) numbers for
            each name.

    Returns:
        the number of points.

    Raises:
        InputError: the survey cannot be read, or has a dimension of such a name from someone else.
        ValueError: ``values`` did not return what ``names`` promises.
    """
    source, target = Path(source), Path(target)
    dimensions = new_dimensions(names, own=True)
    if kind_of(source) != "las":
        cloud = read(source)
        arrays = checked(values(cloud.xyz), dimensions, len(cloud))
        write_cloud(target, cloud, dimensions, arrays, 0.001)
        return len(cloud)
    header = read_header(source)
    kept = tuple(d for d in extra_dimensions(header) if not d.is_own)
    for name in {d.name for d in kept} & {d.name for d, _ in dimensions.values()}:
        raise InputError(
            f"the survey already has a dimension {name!r} that scenenet did not write",
            file=source,
            remedy="Rename or remove it first (pdal translate --writers.las.extra_dims)",
        )
    with atomic(target) as partial, partial.open("w+b") as out:
        _copy(header, out, kept, dimensions, values, is_compressed(target))
    return header.n_points


def _copy(
    header: LasHeader,
    out: BinaryIO,
    kept: tuple[ExtraDimension, ...],
    dimensions: Dimensions,
    values: Values,
    compress: bool,
) -> None:
    keep = _kept_bytes(header)
    length = len(keep) + sum(dtype.itemsize for _, dtype in dimensions.values())
    entries = b"".join(d.entry for d in (*kept, *(d for d, _ in dimensions.values())))
    vlrs = _vlrs(header, entries)
    base = header.record_length - header.n_extra_bytes
    sink = PointSink(out, header.point_format, length - base, compress)
    _write_preamble(header, out, vlrs, sink.record, length)
    sink.start()
    for records in iter_records(header, CHUNK_POINTS):
        arrays = checked(values(coordinates(header, records)), dimensions, len(records))
        widened = np.empty((len(records), length), np.uint8)
        widened[:, : len(keep)] = records if len(keep) == records.shape[1] else records[:, keep]
        at = len(keep)
        for name, (_, dtype) in dimensions.items():
            end = at + dtype.itemsize
            widened[:, at:end] = arrays[name].view(np.uint8).reshape(len(records), -1)
            at = end
        sink.write(widened)
    sink.finish()
    _copy_evlrs(header, out)


def _kept_bytes(header: LasHeader) -> np.ndarray:
    """Positions of the bytes of a record that stay: all but earlier additions of this package."""
    at = header.record_length - header.n_extra_bytes
    keep = [np.arange(at)]
    for dimension in extra_dimensions(header):
        if not dimension.is_own:
            keep.append(np.arange(at, at + dimension.size))
        at += dimension.size
    return np.concatenate(keep)


def _vlrs(header: LasHeader, entries: bytes) -> list[bytes]:
    """The records of the new file: those of the old one, with the new description of extra bytes.

    The old compression record goes (the new one is added by the sink), and so do the COPC records:
    they say at which byte of the file each octree cell lies, which is no longer so.
    """
    dropped = {(EXTRA_USER, EXTRA_RECORD), (LASZIP_USER, LASZIP_RECORD)}
    vlrs = [
        v.raw
        for v in header.vlrs
        if (v.user_id, v.record_id) not in dropped and not _is_copc(header, v.user_id)
    ]
    return vlrs + extra_vlrs(entries)


def _is_copc(header: LasHeader, user_id: str) -> bool:
    return header.format == "copc" and user_id == "copc"


def _write_preamble(
    header: LasHeader,
    out: BinaryIO,
    vlrs: list[bytes],
    laszip: bytes | None,
    record_length: int,
) -> None:
    """Header block, records and gap: all that stands before the points."""
    if laszip is not None:
        vlrs = [*vlrs, laszip_vlr(laszip)]
    if record_length > 0xFFFF:
        raise InputError(
            f"a point would have {record_length} bytes, and LAS allows 65535", file=header.path
        )
    block = bytearray(header.raw)
    offset = len(block) + sum(map(len, vlrs)) + len(header.gap)
    format_byte = header.point_format | (0 if laszip is None else COMPRESSED_BIT)
    struct.pack_into("<IIBH", block, 96, offset, len(vlrs), format_byte, record_length)
    if header.version[1] >= 4:  # a file may have its count in the older field alone
        struct.pack_into("<Q", block, 247, header.n_points)
    out.write(block)
    for record in vlrs:
        out.write(record)
    out.write(header.gap)


def _copy_evlrs(header: LasHeader, out: BinaryIO) -> None:
    """Put the extended records behind the points, and their new places into the header."""
    out.seek(0, 2)
    evlrs = [e for e in header.evlrs if not _is_copc(header, e.user_id)]
    places = {}
    with header.path.open("rb") as source:
        for evlr in evlrs:
            places[evlr.start] = out.tell()
            source.seek(evlr.start)
            left = EVLR_HEAD + evlr.length
            while left:
                block = source.read(min(left, 2**20))
                if not block:
                    raise InputError("the file became shorter while it was read", file=header.path)
                out.write(block)
                left -= len(block)
    minor = header.version[1]
    if minor >= 3:
        # Offsets of waveforms count from the head of their record: moving it whole keeps them.
        waveforms = struct.unpack_from("<Q", header.raw, 227)[0]
        out.seek(227)
        out.write(struct.pack("<Q", places.get(waveforms, 0)))
    if minor >= 4:
        out.seek(235)
        out.write(struct.pack("<QI", min(places.values(), default=0), len(evlrs)))
