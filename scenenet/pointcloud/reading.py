"""Read a survey of any format: whole, in chunks, or its header alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import in_file
from scenenet.pointcloud.class_schemes import class_scheme
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.file_kinds import kind_of
from scenenet.pointcloud.las.crs import CrsRecord, read_crs, with_system
from scenenet.pointcloud.las.header import read_header
from scenenet.pointcloud.las.records import class_codes, coordinates, iter_records
from scenenet.pointcloud.point_fields import (
    PointField,
    PointFields,
    missing_field,
    with_recorded,
)
from scenenet.pointcloud.true_classes import ROUNDING_M, check_same_number, with_true_classes
from scenenet.pointcloud.ts40k import read_sample
from scenenet.pointcloud.units import NotMetres, not_metres, sizes, unit_name

if TYPE_CHECKING:
    import pyproj

CHUNK_POINTS = 1_000_000


@dataclass(frozen=True)
class SurveyInfo:
    """The header of a survey, checked against the size of the file.

    Attributes:
        path: the file.
        format: ``las``, ``laz``, ``copc``, ``npy`` or ``pt``.
        version: LAS version (``"1.4"``); None for other formats.
        point_format: LAS point format 0-10; None for other formats.
        n_points: number of points; the file is large enough for them.
        mins, maxs: bounding box (x, y, z): for LAS the one in the header, which may be wrong, for
            .npy and .pt that of the points. NaN without points.
        record: what the file states about its coordinates.
        scales: step of the stored coordinates (x, y, z); None for .npy and .pt.
        extra_dimensions: names of the dimensions beyond those of the point format.
        warnings: defects of the header that do not prevent reading the points.
    """

    path: Path
    format: str
    version: str | None
    point_format: int | None
    n_points: int
    mins: tuple[float, float, float]
    maxs: tuple[float, float, float]
    record: CrsRecord
    scales: tuple[float, float, float] | None
    extra_dimensions: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def crs(self) -> pyproj.CRS | None:
        """The coordinate reference system; None if the file names none that is understood."""
        return self.record.crs

    @property
    def unit_sizes(self) -> tuple[float, float, float]:
        """Sizes in m of the units of x, y and z (``scenenet.pointcloud.units.sizes``)."""
        return sizes(self.record)

    @property
    def unit_names(self) -> tuple[str, str, str]:
        """Names of the units of x, y and z (``scenenet.pointcloud.units.unit_name``)."""
        planar, vertical = self.record.planar, self.record.vertical
        return unit_name(planar), unit_name(planar), unit_name(vertical or planar)

    @property
    def not_metres(self) -> NotMetres | None:
        """Why the coordinates are known not to be metres, else None."""
        box = (self.mins, self.maxs) if self.n_points else ((np.nan,) * 3, (np.nan,) * 3)
        return not_metres(self.record, *box, self.scales)


def survey_info(path: str | Path, crs: pyproj.CRS | None = None) -> SurveyInfo:
    """The header of a survey; no point of a LAS, LAZ or COPC file is decoded.

    Args:
        crs: the system of the survey if the file states none; None if it is not known.

    Raises:
        InputError: the file is missing, not a point cloud, or its header contradicts its size. It
            states another system than ``crs``, or its coordinates look like degrees and those of
            ``crs`` are lengths.
    """
    info = _header_of(Path(path))
    if crs is None:
        return info
    if not crs.is_geographic and (reason := info.not_metres) and reason.guessed:
        raise reason.error(path)
    with in_file(path):
        return replace(info, record=with_system(info.record, crs))


def _header_of(path: Path) -> SurveyInfo:
    """The header of a survey as it is in the file."""
    kind = kind_of(path)
    if kind != "las":
        xyz, _ = read_sample(path, kind)
        mins, maxs = (xyz.min(0), xyz.max(0)) if len(xyz) else (np.full(3, np.nan),) * 2
        return SurveyInfo(
            path=path, format=kind, version=None, point_format=None, n_points=len(xyz),
            mins=_triple(mins), maxs=_triple(maxs), record=CrsRecord(), scales=None,
            extra_dimensions=(), warnings=(),
        )  # fmt: skip
    header = read_header(path)
    las, record = header.las, read_crs(header.records)
    return SurveyInfo(
        path=path,
        format=header.format,
        version=str(las.version),
        point_format=las.point_format.id,
        n_points=header.las.point_count,
        mins=_triple(las.mins),
        maxs=_triple(las.maxs),
        record=record,
        scales=_triple(las.scales),
        extra_dimensions=tuple(las.point_format.extra_dimension_names),
        warnings=(*header.warnings, *record.problems),
    )


def survey_in_metres(path: str | Path) -> SurveyInfo:
    """The header of a survey whose coordinates are in metres, or whose unit is unknown.

    Voxels, kernels and towers have sizes in metres, so other units are refused, on any axis.

    Raises:
        InputError: as ``survey_info``, and if the coordinates are known not to be metres.
    """
    info = survey_info(path)
    if reason := info.not_metres:
        raise reason.error(path)
    return info


def survey_of_lengths(path: str | Path, crs: pyproj.CRS | None = None) -> SurveyInfo:
    """The header of a survey whose coordinates are lengths, in metres or a unit that it states.

    Args:
        crs: as ``survey_info``.

    Raises:
        InputError: as ``survey_info``, and if the coordinates are not lengths.
    """
    info = survey_info(path, crs)
    if (reason := info.not_metres) and not reason.is_length:
        raise reason.error(path)
    return info


def iter_chunks(
    path: str | Path,
    codes: str | None = None,
    chunk_points: int = CHUNK_POINTS,
    truth: str | Path | None = None,
    fields: Sequence[PointField] = (),
) -> Iterator[PointCloud]:
    """The points of a survey in the order of the file, in chunks.

    For LAS, LAZ and COPC, memory is bounded by a chunk. All points are included: withheld, noise
    and overlap points too. A survey of 0 points gives no chunk. Errors in header, name or codes
    are raised by the call, not by the first chunk.

    Args:
        path: LAS, LAZ, COPC, .npy or .pt file.
        codes: class scheme (a name of ``SCHEMES``); None if unknown.
        chunk_points: points in each chunk except the last.
        truth: a second file with the same points in the same order, whose classes are the truth.
        fields: what else is read of each point.

    Raises:
        InputError: a file cannot be read; the message names it and the reason, even if the
            decoder hung or crashed. Or it does not have ``fields``, which may be known at its end
            only. Or the points of the two files differ; the message names the
            first that does.
    """
    if chunk_points < 1:
        raise ValueError(f"chunk_points must be at least 1, not {chunk_points}")
    path = Path(path)
    scheme = None if codes is None else class_scheme(codes)
    if truth is not None:
        tolerance = same_points(path, truth)
        chunks = iter_chunks(path, codes, chunk_points, fields=fields)
        true = iter_chunks(truth, codes, chunk_points)
        return with_true_classes(path, chunks, Path(truth), true, tolerance)
    kind = kind_of(path)
    if kind != "las":
        if fields:
            raise missing_field(path, fields[0])
        xyz, classes = read_sample(path, kind)
        parts = (slice(at, at + chunk_points) for at in range(0, len(xyz), chunk_points))
        return (PointCloud(xyz[part], classes[part], scheme) for part in parts)
    header = read_header(path)
    crs = read_crs(header.records).crs
    records = iter_records(header, chunk_points, places_only=not fields)
    chunks = (
        PointCloud(
            coordinates(each),
            class_codes(each),
            scheme,
            crs,
            fields=PointFields.of_records(each, fields),
            withheld=np.array(each["withheld"], bool),
        )
        for each in records
    )
    return with_recorded(path, chunks, fields) if fields else chunks


def same_points(labelled: str | Path, truth: str | Path) -> np.ndarray:
    """Check that two files can have the same points, from their headers.

    Returns:
        (3,) m, how much x, y and z of the same point may differ: half a step of each file.

    Raises:
        InputError: a file cannot be read, or their numbers of points differ.
    """
    labels, true = survey_info(labelled), survey_info(truth)
    check_same_number(true.path, true.n_points, labels.path, labels.n_points)
    steps = [np.abs(info.scales or (0.0,) * 3) for info in (labels, true)]
    return np.sum(steps, axis=0) / 2 + ROUNDING_M


def read(
    path: str | Path,
    codes: str | None = None,
    truth: str | Path | None = None,
    fields: Sequence[PointField] = (),
) -> PointCloud:
    """A whole survey as one cloud; see ``iter_chunks`` for surveys larger than memory.

    Raises:
        InputError: as ``iter_chunks``.
    """
    chunks = list(iter_chunks(path, codes, truth=truth, fields=fields))
    if len(chunks) == 1:
        return chunks[0]
    scheme = None if codes is None else class_scheme(codes)
    if not chunks:
        return PointCloud(np.empty((0, 3)), np.empty(0, np.uint8), scheme, survey_info(path).crs)
    xyz = np.concatenate([chunk.xyz for chunk in chunks])
    classes = np.concatenate([chunk.classification for chunk in chunks])
    true = [chunk.truth for chunk in chunks if chunk.truth is not None]
    return PointCloud(
        xyz,
        classes,
        scheme,
        chunks[0].crs,
        np.concatenate(true) if true else None,
        PointFields.joined([chunk.fields for chunk in chunks]),
    )


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
