"""Points of LAS, LAZ and COPC files as laspy's records, in chunks, with a checked header in hand.

Plain LAS is numbers at known places and is read here. Compressed points go through a decoder in a
process of its own.
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
    """The points of a file, ``chunk_points`` each but the last.

    Args:
        header: its checked header.
        chunk_points: points in a chunk.
        places_only: only coordinates and class are needed, which is faster; other fields may be 0.

    Raises:
        InputError: the points cannot be decoded; the message says why.
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
    """(n, 3) float64 coordinates."""
    return np.column_stack([np.asarray(records[axis]) for axis in "xyz"])


def class_codes(records: laspy.ScaleAwarePointRecord) -> np.ndarray:
    """(n,) uint8 class codes, without the flags that share their byte in formats 0-5."""
    return np.array(records["classification"], np.uint8)


def _iter_plain(header: CheckedHeader, chunk_points: int) -> Iterator[laspy.ScaleAwarePointRecord]:
    import laspy

    with laspy.open(header.path, read_evlrs=False) as reader:
        left = header.las.point_count
        while left:
            try:
                records = reader.read_points(chunk_points)
            except ValueError:  # it ends inside a point
                records = laspy.ScaleAwarePointRecord.empty(header=reader.header)
            if len(records) < min(chunk_points, left):
                raise InputError(
                    f"the file became shorter while it was read: {left} points were still to come",
                    file=header.path,
                    remedy="Wait until it is completely written and read it again",
                )
            yield records
            left -= len(records)
