"""The parts that every written LAS file has: extra dimensions, records, and a sink for points."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np

from scenenet.errors import InputError
from scenenet.pointcloud.compression import LASZIP_RECORD, LASZIP_USER
from scenenet.pointcloud.extra import ENTRY, ExtraDimension, new_dimension
from scenenet.pointcloud.extra import RECORD_ID as EXTRA_RECORD
from scenenet.pointcloud.extra import USER as EXTRA_USER

MAX_VLR = 0xFFFF
UNCOMPRESSED_FORMATS = frozenset({9, 10})
"""Formats 9 and 10 hold a waveform packet for each point, which lazrs mixes up where a survey has
several scanner channels (seen with 0.8.2: what it reads back is not what it was given). Such
points are stored uncompressed, also under a ``.laz`` name: readers go by the header."""
Dimension = np.dtype | type | str | tuple[np.dtype | type | str, str]
"""Type of a dimension to add, or (type, description)."""
Dimensions = Mapping[str, tuple[ExtraDimension, np.dtype]]


def new_dimensions(
    names: Mapping[str, Dimension], *, own: bool
) -> dict[str, tuple[ExtraDimension, np.dtype]]:
    made = {}
    for name, given in names.items():
        kind, description = given if isinstance(given, tuple) else (given, "")
        dtype = np.dtype(kind)
        if dtype == np.bool_:
            dtype = np.dtype(np.uint8)
        made[name] = (new_dimension(name, dtype, description, own=own), dtype.newbyteorder("<"))
    return made


def checked(
    arrays: Mapping[str, np.ndarray], dimensions: Dimensions, n: int
) -> dict[str, np.ndarray]:
    if set(arrays) != set(dimensions):
        raise ValueError(f"values for {sorted(arrays)}, but promised were {sorted(dimensions)}")
    result = {}
    for name, (_, dtype) in dimensions.items():
        array = np.asarray(arrays[name])
        if array.shape != (n,):
            raise ValueError(f"{name} must have the shape ({n},), not {array.shape}")
        if dtype.kind in "iu":
            limits = np.iinfo(dtype)
            whole = array.dtype.kind in "iub"
            if not whole or (n and not limits.min <= array.min() <= array.max() <= limits.max):
                raise ValueError(f"{name} has values that {dtype} cannot hold")
        result[name] = array.astype(dtype)
    return result


def is_compressed(target: Path) -> bool:
    suffix = target.suffix.lower()
    if suffix not in (".las", ".laz"):
        raise InputError(
            f"a point cloud cannot be written as {suffix or 'a file without a suffix'}",
            file=target,
            remedy="Name a .laz (compressed) or .las file",
        )
    return suffix == ".laz"


def vlr(user_id: str, record_id: int, description: str, data: bytes) -> bytes:
    head = struct.pack("<2x16sHH32s", user_id.encode(), record_id, len(data), description.encode())
    return head + data


def laszip_vlr(record: bytes) -> bytes:
    return vlr(LASZIP_USER, LASZIP_RECORD, "laszip encoded points", record)


def extra_vlrs(entries: bytes) -> list[bytes]:
    """The records that describe extra dimensions; one, unless there are hundreds of dimensions."""
    step = MAX_VLR // ENTRY * ENTRY
    return [
        vlr(EXTRA_USER, EXTRA_RECORD, "Extra Bytes Record", entries[at : at + step])
        for at in range(0, len(entries), step)
    ]


class PointSink:
    """Where point records go: compressed or as they are."""

    def __init__(self, out: BinaryIO, point_format: int, n_extra: int, compress: bool) -> None:
        self._out = out
        self._compressor = None
        self._laszip = None
        if compress and point_format not in UNCOMPRESSED_FORMATS:
            import lazrs

            self._laszip = lazrs.LazVlr.new_for_compression(point_format, n_extra)

    @property
    def record(self) -> bytes | None:
        """The record that says how the points are compressed."""
        return None if self._laszip is None else bytes(self._laszip.record_data())

    def start(self) -> None:
        """Begin, where the points begin."""
        if self._laszip is not None:
            import lazrs

            self._compressor = lazrs.ParLasZipCompressor(self._out, self._laszip)

    def write(self, records: np.ndarray) -> None:
        if self._compressor is None:
            self._out.write(records.data)
        else:
            self._compressor.compress_many(records.reshape(-1))

    def finish(self) -> None:
        if self._compressor is not None:
            self._compressor.done()
