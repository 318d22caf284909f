"""How the points of a LAZ file are compressed, and whether its chunk table can be believed.

A LAZ file ends with a table of its chunks. When a transfer is cut off, that table is what is
missing, and a damaged one makes decoders ask for absurd amounts of memory; so it is looked at
before a decoder sees the file.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from scenenet.errors import InputError

if TYPE_CHECKING:
    from scenenet.pointcloud.header import Vlr

LASZIP_USER, LASZIP_RECORD = "laszip encoded", 22204
POINTWISE, POINTWISE_CHUNKED, LAYERED_CHUNKED = 1, 2, 3
VARIABLE_CHUNKS = 0xFFFFFFFF
MIN_CHUNK_BYTES = 20
"""A chunk begins with one whole point, and the smallest has 20 bytes."""

REMEDY = (
    "Get the file again from where it came from; if it is the same there, rewrite it "
    "(pdal translate, las2las)"
)


@dataclass(frozen=True)
class Compression:
    """What the LASzip record says.

    Attributes:
        record: the record, as a decoder needs it.
        compressor: 1 one stream of points, 2 chunks of points, 3 chunks of layers.
        chunk_size: points in a chunk; 0xFFFFFFFF where chunks differ in size (COPC).
    """

    record: bytes
    compressor: int
    chunk_size: int

    @property
    def is_chunked(self) -> bool:
        return self.compressor != POINTWISE


def read_compression(path: Path, vlrs: Sequence[Vlr], record_length: int) -> Compression:
    """The LASzip record among ``vlrs``, checked.

    Raises:
        InputError: there is none, or it describes points of another length than the header does.
    """
    found = [v for v in vlrs if (v.user_id, v.record_id) == (LASZIP_USER, LASZIP_RECORD)]
    if not found:
        raise InputError(
            "the header says the points are compressed, but the record that says how is missing",
            file=path,
            remedy=REMEDY,
        )
    data = found[0].data
    n_items = struct.unpack_from("<H", data, 32)[0] if len(data) >= 34 else 0
    end = 34 + 6 * n_items
    if n_items == 0 or len(data) < end:
        raise InputError(
            "the record that says how the points are compressed is cut off",
            file=path,
            remedy=REMEDY,
        )
    compressor = struct.unpack_from("<H", data, 0)[0]
    chunk_size = struct.unpack_from("<I", data, 12)[0]
    if compressor not in (POINTWISE, POINTWISE_CHUNKED, LAYERED_CHUNKED):
        raise InputError(
            f"the points are compressed in a way (compressor {compressor}) that is not known",
            file=path,
            remedy="Uncompress it with laszip and give the LAS file",
        )
    sizes = [struct.unpack_from("<H", data, 34 + 6 * i + 2)[0] for i in range(n_items)]
    if sum(sizes) != record_length:
        raise InputError(
            f"the header says a point has {record_length} bytes, but the compressed ones have "
            f"{sum(sizes)}",
            file=path,
            remedy=REMEDY,
        )
    record = bytearray(data[:end])
    if compressor == POINTWISE:
        # One stream has no chunks. Some writers leave 0 there, which decoders read as "chunks of
        # differing sizes" and then miss their table.
        chunk_size = 1
        struct.pack_into("<I", record, 12, chunk_size)
    return Compression(bytes(record), compressor, chunk_size)


def check_chunk_table(
    path: Path,
    stream: BinaryIO,
    size: int,
    offset: int,
    n_points: int,
    compression: Compression,
) -> None:
    """Compare the chunk table with the file's size and with the point count of the header.

    Raises:
        InputError: the table lies outside of the file, is not one, or contradicts the header.
    """
    if n_points == 0:
        return
    if size < offset + 8 + MIN_CHUNK_BYTES:
        raise InputError(
            f"the header claims {n_points} points, but the file ends at byte {size}, "
            f"{size - offset} bytes behind the place where they begin",
            file=path,
            remedy=REMEDY,
        )
    if not compression.is_chunked:
        return
    n_chunks = _chunk_count(path, stream, size, offset)
    chunk_size = compression.chunk_size
    if chunk_size in (0, VARIABLE_CHUNKS):
        plausible = n_chunks <= n_points
    else:
        expected = -(-n_points // chunk_size)
        if n_chunks < expected or n_chunks > expected + 1:  # some writers add an empty one
            holds = f"{max(n_chunks - 1, 0) * chunk_size + 1} to {n_chunks * chunk_size}"
            raise InputError(
                f"the header claims {n_points} points, but the chunk table tells of {n_chunks} "
                f"chunks of {chunk_size}, so of {holds} points",
                file=path,
                remedy=REMEDY,
            )
        plausible = True
    if not plausible or n_chunks * MIN_CHUNK_BYTES > size:
        raise InputError(
            f"the chunk table claims {n_chunks} chunks, which a file of {size} bytes and "
            f"{n_points} points cannot have",
            file=path,
            remedy=REMEDY,
        )


def _chunk_count(path: Path, stream: BinaryIO, size: int, offset: int) -> int:
    stream.seek(offset)
    table = struct.unpack("<q", stream.read(8))[0]
    if table <= offset:  # written to a pipe: the place of the table is the last number of the file
        stream.seek(size - 8)
        table = struct.unpack("<q", stream.read(8))[0]
    if table <= offset or table + 8 > size:
        raise InputError(
            f"the table of its compressed chunks should be at byte {table}, but the points begin "
            f"at byte {offset} and the file ends at byte {size}: it is cut off, or was never "
            "finished",
            file=path,
            remedy=REMEDY,
        )
    stream.seek(table)
    version, n_chunks = struct.unpack("<II", stream.read(8))
    if version != 0 or n_chunks == 0:
        raise InputError(
            f"what should be the table of its compressed chunks, at byte {table}, is not one: the "
            "file is damaged, or was never finished",
            file=path,
            remedy=REMEDY,
        )
    return n_chunks
