"""Points of LAS, LAZ and COPC files as laspy records, in chunks, given a checked header.

Uncompressed points are read directly. Compressed points are decoded in a separate process.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.las.header import CheckedHeader
from scenenet.pointcloud.las.isolation import decompress

if TYPE_CHECKING:
    import laspy


def iter_records(
    header: CheckedHeader, chunk_points: int, *, places_only: bool = False
) -> Iterator[laspy.ScaleAwarePointRecord]:
    """The points of a file, in chunks of ``chunk_points`` except the last.

    Args:
        header: its checked header.
        chunk_points: points in a chunk.
        places_only: only coordinates, class and flags are needed, which is faster; other fields
            may be 0.

    Raises:
        InputError: the points cannot be decoded; the message has the reason.
    """
    import laspy

    if header.las.point_count == 0:
        return
    las = header.las
    if las.are_points_compressed:
        for chunk in decompress(header, chunk_points, places_only=places_only):
            yield laspy.ScaleAwarePointRecord(chunk, las.point_format, las.scales, las.offsets)
    else:
        yield from _iter_plain(header, chunk_points)


def coordinates(records: laspy.ScaleAwarePointRecord) -> np.ndarray:
    """(n, 3) float64 coordinates x, y, z in the unit of the file."""
    return np.column_stack([np.asarray(records[axis]) for axis in "xyz"])


def class_codes(records: laspy.ScaleAwarePointRecord) -> np.ndarray:
    """(n,) uint8 class codes, without the flags that share the byte in formats 0 to 5."""
    return np.array(records["classification"], np.uint8)


def _iter_plain(header: CheckedHeader, chunk_points: int) -> Iterator[laspy.ScaleAwarePointRecord]:
    import laspy

    with laspy.open(header.path, read_evlrs=False) as reader:
        left = header.las.point_count
        while left:
            try:
                records = reader.read_points(chunk_points)
            except ValueError:  # the file ends inside a point
                records = laspy.ScaleAwarePointRecord.empty(header=reader.header)
            if len(records) < min(chunk_points, left):
                raise InputError(
                    f"the file became shorter while it was read: {left} points are missing",
                    file=header.path,
                    remedy="Wait until it is completely written, then read it again",
                )
            yield records
            left -= len(records)
