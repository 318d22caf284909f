"""Check the octree of a COPC file.

Its cells are chunks, listed in pages with the number of points of each. A sum that is not the
number of points in the header means that points are missing.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np

from scenenet.core.errors import InputError

COPC_INFO = ("copc", 1)
"""User and number of the first record of a COPC file."""
ENTRY = np.dtype([("key", "<i4", 4), ("offset", "<u8"), ("size", "<i4"), ("points", "<i4")])
PAGE = -1
"""Number of points of an entry that is a page with further entries."""
REMEDY = (
    "Get the file again from its source; if it is damaged there too, rewrite it "
    "(pdal translate, las2las)"
)


def check_octree(path: Path, n_points: int, info: bytes, stream: BinaryIO, size: int) -> None:
    """Compare the points of all cells with the number in the header.

    Args:
        path: the file.
        n_points: the number in the header.
        info: content of the record ``COPC_INFO``.
        stream: the file, ``size`` bytes.

    Raises:
        InputError: the pages of the octree are outside the file, or their points do not sum to
            ``n_points``.
    """
    if len(info) < 56:
        raise InputError("its COPC record is too short", file=path, remedy=REMEDY)
    pages = [struct.unpack_from("<QQ", info, 40)]
    seen: set[int] = set()
    total = 0
    while pages:
        offset, length = pages.pop()
        if offset in seen or length < 0 or offset + length > size:
            raise InputError(
                f"a page of its octree should be at byte {offset}, {length} bytes long, but the "
                f"file has {size} bytes, or the page occurs twice",
                file=path,
                remedy=REMEDY,
            )
        seen.add(offset)
        stream.seek(offset)
        entries = np.frombuffer(stream.read(length // ENTRY.itemsize * ENTRY.itemsize), ENTRY)
        total += int(entries["points"][entries["points"] > 0].sum())
        pages += [
            (int(entry["offset"]), int(entry["size"]))
            for entry in entries[entries["points"] == PAGE]
        ]
    if total != n_points:
        raise InputError(
            f"the header claims {n_points} points, but the cells of its octree have {total}",
            file=path,
            remedy=REMEDY,
        )
