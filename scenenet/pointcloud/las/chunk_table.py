"""Check the chunk table of a LAZ file.

A LAZ file ends with a table of its chunks. An interrupted transfer loses that table; a damaged
table makes decoders allocate excessive memory; a table with more points than the header means
points that would not be read. So the table is checked before decoding.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from scenenet.core.errors import InputError

if TYPE_CHECKING:
    import laspy

POINTWISE = 1
"""The compressor that writes one stream of points without chunks."""
VARIABLE_CHUNKS = (0, 0xFFFFFFFF)
MIN_CHUNK_BYTES = 20
"""A chunk starts with one whole point, and the smallest point has 20 bytes."""
REMEDY = (
    "Get the file again from its source; if it is damaged there too, rewrite it "
    "(pdal translate, las2las)"
)


def check_chunks(path: Path, las: laspy.LasHeader, stream: BinaryIO, size: int) -> None:
    """Compare the chunk table with the size of the file and the point count of its header.

    Raises:
        InputError: the table is outside the file, invalid, or contradicts the header.
    """
    n_points, offset = las.point_count, las.offset_to_point_data
    found = las.vlrs.get("LasZipVlr")
    if not found or len(found[0].record_data) < 16:
        raise InputError(
            "the header says that the points are compressed, but not how: a record is missing",
            file=path,
            remedy=REMEDY,
        )
    compressor, chunk_size = struct.unpack_from("<H10xI", found[0].record_data)
    if n_points == 0 or compressor == POINTWISE:
        return
    table = _number(stream, offset)
    if (
        table <= offset
    ):  # written to a pipe: the last number of the file is the position of the table
        table = _number(stream, size - 8)
    if table <= offset or table + 8 > size:
        raise InputError(
            f"the table of its compressed chunks should be at byte {table}, but the points start "
            f"at byte {offset} and the file ends at byte {size}: it is truncated or was never "
            "finished",
            file=path,
            remedy=REMEDY,
        )
    n_chunks, version = divmod(_number(stream, table), 2**32)
    if chunk_size in VARIABLE_CHUNKS:
        fits, of = 0 < n_chunks <= n_points, ""
    else:
        expected = -(-n_points // chunk_size)  # some writers add an empty one
        fits, of = n_chunks in (expected, expected + 1), f" of {chunk_size} points"
    if version != 0 or not fits or n_chunks * MIN_CHUNK_BYTES > size:
        raise InputError(
            f"the header claims {n_points} points, but the table of its compressed chunks has "
            f"{n_chunks} chunks{of} (version {version}) in {size} bytes",
            file=path,
            remedy=REMEDY,
        )


def _number(stream: BinaryIO, at: int) -> int:
    """The 64-bit number at a byte of the file; 0 if the file is too short."""
    stream.seek(max(at, 0))
    data = stream.read(8)
    return struct.unpack("<q", data)[0] if len(data) == 8 else 0
