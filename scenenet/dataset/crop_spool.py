"""The points of crops on disk while a survey is read, so that memory is bounded by one crop."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.pointcloud.cloud import PointCloud

RECORD = np.dtype([("xyz", "<f8", 3), ("classification", "u1"), ("truth", "u1")])


def append(spool: Path, chunk: PointCloud, rows: np.ndarray) -> None:
    """Append the points at ``rows`` (n,) of a chunk to the file of a crop."""
    if len(rows) == 0:
        return
    records = np.empty(len(rows), RECORD)
    records["xyz"] = chunk.xyz[rows]
    records["classification"] = chunk.classification[rows]
    records["truth"] = 0 if chunk.truth is None else chunk.truth[rows]
    with spool.open("ab") as stream:
        stream.write(records.tobytes())


def spooled(spool: Path, scheme: ClassScheme, with_truth: bool) -> PointCloud:
    """The points in the file of a crop.

    Args:
        scheme: of their class codes.
        with_truth: whether their truth is known.
    """
    records = np.fromfile(spool, RECORD)
    return PointCloud(
        np.ascontiguousarray(records["xyz"]),
        records["classification"].copy(),
        scheme,
        truth=records["truth"].copy() if with_truth else None,
    )
