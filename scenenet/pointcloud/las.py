"""Points of LAS, LAZ and COPC files, in pieces, with a checked header in hand.

Plain LAS is numbers at known places: it is read here, with numpy. Compressed points go through a
decoder in a process of its own.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from scenenet.errors import InputError
from scenenet.pointcloud.header import LasHeader
from scenenet.pointcloud.isolation import class_byte, decompress

LEGACY_CLASS_MASK = 0x1F
"""In point formats 0-5 the upper three bits of the class byte are flags."""


def iter_records(header: LasHeader, chunk_points: int) -> Iterator[np.ndarray]:
    """The point records as they are: (n, record_length) uint8, at most ``chunk_points`` each.

    Raises:
        InputError: the points cannot be decoded; the message says why.
    """
    if header.n_points == 0:
        return
    if header.compression is None:
        yield from _iter_plain(header, chunk_points)
        return
    for piece in decompress(header, whole_records=True):
        assert isinstance(piece, np.ndarray)
        for start in range(0, len(piece), chunk_points):
            yield piece[start : start + chunk_points]


def iter_points(header: LasHeader, chunk_points: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Coordinates (n, 3) float64 and class codes (n,) uint8, ``chunk_points`` each but the last.

    Raises:
        InputError: the points cannot be decoded; the message says why.
    """
    if header.n_points == 0:
        return
    if header.compression is None:
        for records in _iter_plain(header, chunk_points):
            yield coordinates(header, records), class_codes(header, records)
        return
    left = header.n_points
    xyz, codes = _room(min(chunk_points, left))
    filled = 0
    for integers, class_bytes in decompress(header, whole_records=False):
        start = 0
        while start < len(class_bytes):
            n = min(len(class_bytes) - start, len(codes) - filled)
            into, of = slice(filled, filled + n), slice(start, start + n)
            _scale(header, integers[:, of], xyz[into])
            codes[into] = _codes(header, class_bytes[of])
            start, filled = start + n, filled + n
            if filled == len(codes):
                yield xyz, codes
                left -= filled
                xyz, codes = _room(min(chunk_points, left))
                filled = 0


def coordinates(header: LasHeader, records: np.ndarray) -> np.ndarray:
    """(n, 3) float64 coordinates of (n, record_length) uint8 records."""
    xyz = np.empty((len(records), 3))
    _scale(header, integers_of(records).T, xyz)
    return xyz


def integers_of(records: np.ndarray) -> np.ndarray:
    """(n, 3) int32 stored coordinates of (n, record_length) uint8 records."""
    return np.ascontiguousarray(records[:, :12]).view("<i4")


def class_codes(header: LasHeader, records: np.ndarray) -> np.ndarray:
    """(n,) uint8 class codes, without the flags that share their byte in formats 0-5."""
    return _codes(header, records[:, class_byte(header)])


def _codes(header: LasHeader, class_bytes: np.ndarray) -> np.ndarray:
    return class_bytes & LEGACY_CLASS_MASK if header.point_format < 6 else class_bytes.copy()


def _scale(header: LasHeader, integers: np.ndarray, out: np.ndarray) -> None:
    for axis in range(3):
        np.multiply(integers[axis], header.scales[axis], out=out[:, axis])
        out[:, axis] += header.offsets[axis]


def _room(n: int) -> tuple[np.ndarray, np.ndarray]:
    return np.empty((n, 3)), np.empty(n, np.uint8)


def _iter_plain(header: LasHeader, chunk_points: int) -> Iterator[np.ndarray]:
    left = header.n_points
    with header.path.open("rb", buffering=0) as stream:
        stream.seek(header.offset_to_points)
        while left:
            records = np.empty((min(chunk_points, left), header.record_length), np.uint8)
            view = records.data.cast("B")
            at = 0
            while at < len(view):
                got = stream.readinto(view[at:])
                if not got:
                    raise InputError(
                        f"the file became shorter while it was read: {left} of "
                        f"{header.n_points} points are missing",
                        file=header.path,
                        remedy="Wait until it is completely written and read it again",
                    )
                at += got
            yield records
            left -= len(records)
