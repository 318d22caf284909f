"""Writing a point cloud as a new LAS or LAZ file."""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.errors import InputError
from scenenet.files import atomic
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.header import COMPRESSED_BIT, HEADER_SIZES, RECORD_LENGTHS
from scenenet.pointcloud.records import (
    Dimensions,
    PointSink,
    checked,
    extra_vlrs,
    is_compressed,
    laszip_vlr,
    new_dimensions,
    vlr,
)

if TYPE_CHECKING:
    import pyproj

CHUNK_POINTS = 500_000
INT32_MAX = np.iinfo(np.int32).max
WKT_BIT = 0x10
HEADER_SIZE, POINT_FORMAT = HEADER_SIZES[4], 6
ONE_RETURN = 0x11
"""Return number 1 of 1."""


def write_las(
    path: str | Path,
    cloud: PointCloud,
    *,
    extra: Mapping[str, np.ndarray] | None = None,
    scale: float = 0.001,
) -> None:
    """Write a cloud as LAS 1.4, point format 6; compressed where the suffix is ``.laz``.

    The file appears whole or not at all.

    Args:
        path: ``.las`` or ``.laz`` file.
        cloud: points, class codes and CRS; the CRS is written as WKT.
        extra: further dimensions, name -> (N,) numbers.
        scale: metres between two coordinates that can be told apart.

    Raises:
        InputError: the coordinates are not finite, or too far apart for that scale.
        ValueError: an extra dimension has the wrong length, or a name or type that LAS cannot hold.
    """
    extra = {name: np.asarray(values) for name, values in (extra or {}).items()}
    names = {name: (values.dtype, "") for name, values in extra.items()}
    write_cloud(Path(path), cloud, new_dimensions(names, own=False), extra, scale)


def write_cloud(
    path: Path,
    cloud: PointCloud,
    dimensions: Dimensions,
    extra: Mapping[str, np.ndarray],
    scale: float,
) -> None:
    compress = is_compressed(path)
    arrays = checked(extra, dimensions, len(cloud))
    offsets, mins, maxs = _offsets(path, cloud.xyz, scale)
    base = RECORD_LENGTHS[POINT_FORMAT]
    length = base + sum(dtype.itemsize for _, dtype in dimensions.values())
    entries = b"".join(d.entry for d, _ in dimensions.values())
    with atomic(path) as partial, partial.open("w+b") as out:
        sink = PointSink(out, POINT_FORMAT, length - base, compress)
        vlrs = [] if cloud.crs is None else [_wkt_vlr(cloud.crs)]
        vlrs += extra_vlrs(entries)
        if sink.record is not None:
            vlrs.append(laszip_vlr(sink.record))
        out.write(_new_header(len(cloud), vlrs, length, compress, scale, offsets, mins, maxs))
        for record in vlrs:
            out.write(record)
        sink.start()
        for at in range(0, len(cloud), CHUNK_POINTS):
            part = slice(at, at + CHUNK_POINTS)
            records = np.zeros((len(cloud.xyz[part]), length), np.uint8)
            integers = np.rint((cloud.xyz[part] - offsets) / scale).astype("<i4")
            records[:, :12] = integers.view(np.uint8)
            records[:, 14] = ONE_RETURN
            records[:, 16] = cloud.classification[part]
            place = base
            for name, (_, dtype) in dimensions.items():
                end = place + dtype.itemsize
                values = np.ascontiguousarray(arrays[name][part])
                records[:, place:end] = values.view(np.uint8).reshape(len(records), -1)
                place = end
            sink.write(records)
        sink.finish()


def _offsets(path: Path, xyz: np.ndarray, scale: float):
    if not scale > 0:
        raise ValueError(f"the scale must be above 0, not {scale}")
    if len(xyz) == 0:
        return np.zeros(3), np.zeros(3), np.zeros(3)
    mins, maxs = xyz.min(axis=0), xyz.max(axis=0)
    if not np.isfinite([mins, maxs]).all():
        raise InputError("coordinates that are not numbers cannot be written", file=path)
    # Whole kilometres, so that files of one area share their offsets and the stored steps agree.
    offsets = np.floor(mins / 1000) * 1000
    if ((maxs - offsets) / scale > INT32_MAX).any():
        offsets = np.floor((mins + maxs) / 2)
    if (np.maximum(maxs - offsets, offsets - mins) / scale > INT32_MAX).any():
        raise InputError(
            f"the points are {(maxs - mins).max():g} m apart, which steps of {scale:g} m cannot "
            "tell in a LAS file",
            file=path,
            remedy="Remove stray points, or write with a larger scale",
        )
    stored = np.rint((np.array([mins, maxs]) - offsets) / scale) * scale + offsets
    return offsets, stored[0], stored[1]


def _new_header(
    n: int, vlrs: list[bytes], length: int, compress: bool, scale: float, offsets, mins, maxs
) -> bytes:
    """Public header block of LAS 1.4 (R15, Table 3), without a date: same points, same file."""
    block = bytearray(HEADER_SIZE)
    block[:4] = b"LASF"
    struct.pack_into("<H", block, 6, WKT_BIT)
    block[24:26] = b"\x01\x04"
    struct.pack_into("<32s32s", block, 26, b"EXTRACTION", b"scenenet")
    offset = HEADER_SIZE + sum(map(len, vlrs))
    format_byte = POINT_FORMAT | (COMPRESSED_BIT if compress else 0)
    struct.pack_into("<HIIBH", block, 94, HEADER_SIZE, offset, len(vlrs), format_byte, length)
    box = np.column_stack([maxs, mins]).ravel()
    struct.pack_into("<12d", block, 131, *([scale] * 3), *offsets, *box)
    struct.pack_into("<QQ", block, 247, n, n)  # all points, and those of the first return
    return bytes(block)


def _wkt_vlr(crs: pyproj.CRS) -> bytes:
    import pyproj

    # LAS 1.4 asks for WKT 1. Where that would lose something, WKT 2 is better than a wrong system.
    text = crs.to_wkt()
    with contextlib.suppress(pyproj.exceptions.CRSError):
        old = crs.to_wkt("WKT1_GDAL")
        if pyproj.CRS.from_wkt(old).equals(crs, ignore_axis_order=True):
            text = old
    return vlr("LASF_Projection", 2112, "OGC coordinate system WKT", text.encode() + b"\0")
