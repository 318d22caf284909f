"""The points of crops on disk while a survey is read, so that memory is bounded by one crop."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.point_fields import PointField, PointFields, array_types

_RECORD = [("xyz", "<f8", 3), ("classification", "u1"), ("truth", "u1")]


def record_type(fields: Sequence[PointField] = ()) -> np.dtype:
    """What is written of a point with some fields."""
    return np.dtype([*_RECORD, *array_types(fields).items()])


def append(
    spool: Path, chunk: PointCloud, rows: np.ndarray, fields: Sequence[PointField] = ()
) -> None:
    """Append the points at ``rows`` (n,) of a chunk, with some fields, to the file of a crop."""
    if len(rows) == 0:
        return
    records = np.empty(len(rows), record_type(fields))
    records["xyz"] = chunk.xyz[rows]
    records["classification"] = chunk.classification[rows]
    records["truth"] = 0 if chunk.truth is None else chunk.truth[rows]
    if chunk.fields is not None:
        for name in array_types(fields):
            records[name] = chunk.fields.arrays()[name][rows]
    with spool.open("ab") as stream:
        stream.write(records.tobytes())


def spooled(
    spool: Path, scheme: ClassScheme, with_truth: bool, fields: Sequence[PointField] = ()
) -> PointCloud:
    """The points in the file of a crop.

    Args:
        scheme: of their class codes.
        with_truth: whether their truth is known.
        fields: that were written.
    """
    records = np.fromfile(spool, record_type(fields))
    return PointCloud(
        np.ascontiguousarray(records["xyz"]),
        records["classification"].copy(),
        scheme,
        truth=records["truth"].copy() if with_truth else None,
        fields=PointFields.of_arrays(records, fields),
    )
