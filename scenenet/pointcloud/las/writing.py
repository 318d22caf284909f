"""Write a point cloud as a new LAS or LAZ file."""

from __future__ import annotations

import contextlib
import datetime
import io
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.files import atomic
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.las.extra_dimensions import checked, new_dimensions

if TYPE_CHECKING:
    import laspy
    import pyproj
    from typing_extensions import Buffer

CHUNK_POINTS = 500_000
INT32_MAX = np.iinfo(np.int32).max
NO_DATE = datetime.date.min
"""Means no date, so that the same points give the same file; laspy would write the current date."""


def write_las(
    path: str | Path,
    cloud: PointCloud,
    *,
    extra: Mapping[str, np.ndarray] | None = None,
    scale: float = 0.001,
) -> None:
    """Write a cloud as LAS 1.4, point format 6; compressed if the suffix is ``.laz``.

    The file is written whole or not at all.

    Args:
        path: ``.las`` or ``.laz`` file.
        cloud: points, class codes and CRS; the CRS is written as WKT.
        extra: further dimensions, name -> (N,) numbers.
        scale: step of the stored coordinates, m.

    Raises:
        InputError: the coordinates are not finite, or too far apart for the scale.
        ValueError: an extra dimension has the wrong length, or a name or type that LAS cannot
            store.
    """
    extra = {name: np.asarray(values) for name, values in (extra or {}).items()}
    names = {name: (values.dtype, "") for name, values in extra.items()}
    write_cloud(Path(path), cloud, new_dimensions(names, own=False), extra, scale)


def write_cloud(
    path: Path,
    cloud: PointCloud,
    dimensions: list[laspy.ExtraBytesParams],
    extra: Mapping[str, np.ndarray],
    scale: float,
) -> None:
    arrays = checked(extra, dimensions, len(cloud))
    header = _header(cloud.crs, _offsets(path, cloud.xyz, scale), scale)
    header.add_extra_dims(dimensions)
    with open_writer(path, header) as writer:
        for at in range(0, len(cloud), CHUNK_POINTS):
            part = slice(at, at + CHUNK_POINTS)
            columns = {name: values[part] for name, values in arrays.items()}
            _write_points(writer, cloud.xyz[part], cloud.classification[part], columns)


@contextlib.contextmanager
def las_stream(
    path: str | Path,
    crs: pyproj.CRS | None,
    offsets: np.ndarray,
    scale: float = 0.001,
    software: str = "scenenet",
) -> Iterator[Callable[[np.ndarray, np.ndarray], None]]:
    """Write a survey in parts, otherwise as ``write_las``.

    Yields a function that takes the next points (N, 3) and their codes (N,).

    Args:
        offsets: (3,) m; points must be within 2^31 ``scale`` of it.
        software: what the header names as the software that made the file.
    """
    with open_writer(Path(path), _header(crs, offsets, scale, software)) as writer:

        def write(xyz: np.ndarray, classification: np.ndarray) -> None:
            for at in range(0, len(xyz), CHUNK_POINTS):
                part = slice(at, at + CHUNK_POINTS)
                _write_points(writer, xyz[part], classification[part], {})

        yield write


def _header(
    crs: pyproj.CRS | None, offsets: np.ndarray, scale: float, software: str = "scenenet"
) -> laspy.LasHeader:
    import laspy

    header = laspy.LasHeader(version="1.4", point_format=6)
    header.system_identifier, header.generating_software = "EXTRACTION", software
    header.creation_date = NO_DATE
    header.scales, header.offsets = np.full(3, float(scale)), np.asarray(offsets, float)
    if crs is not None:
        header.add_crs(crs)
    return header


def _write_points(
    writer: laspy.LasWriter,
    xyz: np.ndarray,
    classification: np.ndarray,
    columns: Mapping[str, np.ndarray],
) -> None:
    import laspy

    points = laspy.ScaleAwarePointRecord.zeros(len(xyz), header=writer.header)
    for axis, name in enumerate("xyz"):
        points[name][:] = xyz[:, axis]
    points["classification"] = classification
    points["return_number"][:] = points["number_of_returns"][:] = 1
    for name, values in columns.items():
        points[name] = values
    writer.write_points(points)


@contextlib.contextmanager
def open_writer(path: Path, header: laspy.LasHeader) -> Iterator[laspy.LasWriter]:
    """laspy's writer of a file that is written whole or not at all; the suffix decides compression.

    Raises:
        InputError: the suffix is neither ``.las`` nor ``.laz``.
    """
    import laspy

    suffix = path.suffix.lower()
    if suffix not in (".las", ".laz"):
        raise InputError(
            f"the suffix {suffix!r} is not one of a LAS or LAZ file",
            file=path,
            remedy="Choose a .laz (compressed) or .las file",
        )
    for record in header.vlrs.get("ExtraBytesVlr"):
        for entry in record.extra_bytes_structs:
            if entry.data_type:  # 0 means plain bytes, whose options are a count
                # laspy takes the first point of a chunk as its minimum and maximum.
                entry.options &= ~(entry.MIN_BIT_MASK | entry.MAX_BIT_MASK)
    with atomic(path) as partial, _Stream(partial) as stream:
        try:
            with laspy.open(
                stream,
                mode="w",
                closefd=False,
                do_compress=suffix == ".laz",
                header=header,
                encoding_errors="surrogateescape",  # keeps text that is not ASCII as bytes
            ) as writer:
                yield writer
        except Exception as error:
            if stream.error is not None:
                raise stream.error from error
            raise


class _Stream(io.BufferedWriter):
    """A file that remembers why it could not be written: the compressor does not say why."""

    def __init__(self, path: Path) -> None:
        super().__init__(io.FileIO(path, "w"))
        self.error: OSError | None = None

    def write(self, data: Buffer, /) -> int:
        try:
            return super().write(data)
        except OSError as error:
            self.error = error
            raise


def _offsets(path: Path, xyz: np.ndarray, scale: float) -> np.ndarray:
    if not scale > 0:
        raise ValueError(f"the scale must be above 0, not {scale}")
    if len(xyz) == 0:
        return np.zeros(3)
    mins, maxs = xyz.min(axis=0), xyz.max(axis=0)
    if not np.isfinite([mins, maxs]).all():
        raise InputError("some coordinates are not finite, so they cannot be written", file=path)
    # Whole kilometres, so that files of one area have the same offsets and grid of coordinates.
    offsets = np.floor(mins / 1000) * 1000
    if ((maxs - offsets) / scale > INT32_MAX).any():
        offsets = np.floor((mins + maxs) / 2)
    if (np.maximum(maxs - offsets, offsets - mins) / scale > INT32_MAX).any():
        raise InputError(
            f"the points are {(maxs - mins).max():g} m apart, which is too far for steps of "
            f"{scale:g} m in a LAS file",
            file=path,
            remedy="Remove stray points, or write with a larger scale",
        )
    return offsets
