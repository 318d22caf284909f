"""Write a copy of a survey with further dimensions and nothing else changed."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.unchanged import FileState, unchanged
from scenenet.pointcloud.file_kinds import kind_of
from scenenet.pointcloud.las.crs import USERS, WKT_RECORD, crs_records, states_system
from scenenet.pointcloud.las.extra_dimensions import OWN_MARK, Dimension, checked, new_dimensions
from scenenet.pointcloud.las.header import CheckedHeader, Vlr, read_header
from scenenet.pointcloud.las.records import coordinates, iter_records
from scenenet.pointcloud.las.writing import NO_DATE, open_writer, write_cloud
from scenenet.pointcloud.reading import read

if TYPE_CHECKING:
    import laspy
    import pyproj

CHUNK_POINTS = 200_000
REWRITTEN = {("LASF_Spec", 4), ("laszip encoded", 22204)}
"""Records that laspy creates itself: the descriptions of extra bytes and of the compression."""
PLAIN_BYTES = 7
"""Extra bytes without a description are written as dimensions of this many bytes: laspy
misinterprets the number of more bytes as a scale, and cannot read the file that it wrote."""
MIXED_UP_FORMATS = (9, 10)
"""Formats whose waveform packets lazrs mixes up if a survey has several scanner channels (seen
with 0.8.2: it does not read back what it wrote)."""
MAX_RECORD, MAX_EXTRA = 0xFFFF, 0xFFFF // 192
"""Most bytes of a point, and most extra dimensions: each takes 192 bytes of a record that has at
most ``MAX_RECORD``."""
Values = Callable[[np.ndarray], Mapping[str, np.ndarray]]
"""Coordinates (n, 3) -> name -> (n,) values."""
Classify = Callable[[Mapping[str, np.ndarray], np.ndarray], np.ndarray]
"""Values of the new dimensions, class codes (n,) -> new class codes (n,)."""


def add_dimensions(
    source: str | Path,
    target: str | Path,
    names: Mapping[str, Dimension],
    values: Values,
    state: FileState | None = None,
    classify: Classify | None = None,
    crs: pyproj.CRS | None = None,
) -> int:
    """Write a copy of a survey, with all of its points and content, and further dimensions.

    Points keep their order, stored integers, scale and offset and all other dimensions; the CRS and
    the bytes of variable length records, extended ones too, are copied. Dimensions that an earlier
    call added (their description says ``scenenet``) are replaced. Memory is bounded by a chunk. A
    COPC survey is written as plain LAZ, in the order of its file.

    Args:
        source: the survey: LAS, LAZ, COPC, or a .npy / .pt sample (written as ``write_las`` does).
        target: ``.laz`` (or ``.las``) file; written whole or not at all; may be ``source``.
        names: name -> numpy type, or (type, description of up to 22 characters).
        values: gets (n, 3) float64 coordinates of consecutive points, returns (n,) numbers for
            each name.
        state: of the survey when ``values`` was made; None for now. Another state is an error,
            and ``target`` stays as it was.
        classify: gives each point its class code; None to keep all codes.
        crs: written if the survey has no record of a system at all.

    Returns:
        the number of points.

    Raises:
        InputError: the survey cannot be read, has a dimension of the same name that another
            program wrote, has waveforms that cannot be kept, has no room for more dimensions, or
            changes while it is read.
        ValueError: ``values`` did not return an array for each of ``names``.
    """
    source, target = Path(source), Path(target)
    state = state or FileState.of(source)
    dimensions = new_dimensions(names, own=True)
    with unchanged(state):
        kind = kind_of(source)
    if kind != "las":
        with unchanged(state):
            cloud = read(source)
            arrays = checked(values(cloud.xyz), dimensions, len(cloud))
        if classify is not None:
            cloud = replace(cloud, classification=classify(arrays, cloud.classification))
        if crs is not None:
            cloud = replace(cloud, crs=crs)
        write_cloud(target, cloud, dimensions, arrays, 0.001)
        return len(cloud)
    with unchanged(state):
        header = read_header(source)
    channels: set[int] = set()
    with open_writer(target, _extended(header, dimensions, crs)) as writer, unchanged(state):
        for records in iter_records(header, CHUNK_POINTS):
            if writer.header.point_format.id in MIXED_UP_FORMATS:
                channels.update(np.unique(records["scanner_channel"]).tolist())
                _check_channels(source, channels, writer.header.are_points_compressed)
            arrays = checked(values(coordinates(records)), dimensions, len(records))
            points = _widened(records, writer.header, arrays)
            if classify is not None:
                points["classification"] = classify(arrays, np.asarray(points["classification"]))
            writer.write_points(points)
        _write_evlrs(writer, header)
    return header.las.point_count


def _widened(
    records: laspy.ScaleAwarePointRecord,
    header: laspy.LasHeader,
    arrays: Mapping[str, np.ndarray],
) -> laspy.ScaleAwarePointRecord:
    """``records`` as points of ``header``: their bytes, followed by the new dimensions."""
    import laspy

    points = laspy.ScaleAwarePointRecord.zeros(len(records), header=header)
    old, new = (r.array.view(np.uint8).reshape(len(r), -1) for r in (records, points))
    kept = np.ones(old.shape[1], bool)
    for dimension in filter(_is_own, records.point_format.extra_dimensions):
        dtype, at = records.array.dtype.fields[dimension.name][:2]
        kept[at : at + dtype.itemsize] = False
    new[:, : kept.sum()] = old if kept.all() else old[:, kept]
    for name, values in arrays.items():
        points.array[name] = values
    return points


def _extended(
    header: CheckedHeader, dimensions: list[laspy.ExtraBytesParams], crs: pyproj.CRS | None
) -> laspy.LasHeader:
    """The header of the new file: that of the survey with the new dimensions, and with the system
    if it has none."""
    import laspy

    _check_can_be_kept(header, {d.name for d in dimensions})
    new = copy.deepcopy(header.las)
    entries = {
        entry.format_name(): entry
        for record in new.vlrs.get("ExtraBytesVlr")
        for entry in record.extra_bytes_structs
    }
    for dimension in list(new.point_format.extra_dimensions):
        if _is_own(dimension):
            new.remove_extra_dim(dimension.name)
        elif dimension.name not in entries and dimension.num_elements > PLAIN_BYTES:
            new.remove_extra_dim(dimension.name)
            sizes = [PLAIN_BYTES] * (dimension.num_elements // PLAIN_BYTES)
            sizes += [rest] if (rest := dimension.num_elements % PLAIN_BYTES) else []
            new.add_extra_dims([
                laspy.ExtraBytesParams(f"{dimension.name}{i}", f"{size}u1", dimension.description)
                for i, size in enumerate(sizes, 1)
            ])  # fmt: skip
    new.add_extra_dims(dimensions)
    n_extra = len(list(new.point_format.extra_dimensions))
    if new.point_format.size > MAX_RECORD or n_extra > MAX_EXTRA:
        raise InputError(
            f"a point would have {new.point_format.size} bytes and {n_extra} extra dimensions, "
            f"but LAS has room for {MAX_RECORD} and {MAX_EXTRA}",
            file=header.path,
            remedy="Remove extra dimensions first (pdal translate --writers.las.extra_dims)",
        )
    new.vlrs = [
        _as_stored(v)
        for v in header.vlrs
        if (v.user_id, v.record_id) not in REWRITTEN and not _is_octree(header, v.user_id)
    ]
    if crs is not None and not states_system(header.records):
        records = crs_records(crs, new.point_format.id)
        new.vlrs.extend([laspy.VLR(USERS[0], number, "", data) for number, data in records])
        is_wkt = records[0][0] == WKT_RECORD
        new.global_encoding.wkt = is_wkt and new.version.minor >= 4  # reserved before
    for record in new.vlrs.get("ExtraBytesVlr"):  # laspy loses the "no data" value too
        record.extra_bytes_structs = [
            entry if entry.format_name() in {d.name for d in dimensions}
            else entries.get(entry.format_name(), entry)
            for entry in record.extra_bytes_structs
        ]  # fmt: skip
    new.creation_date = new.creation_date or NO_DATE
    # laspy writes LAS 1.1 and later, and a point format only in versions that have it.
    version, dims = laspy.header.Version, laspy.point.dims
    if new.point_format.id not in dims.VERSION_TO_POINT_FMT.get(str(new.version), ()):
        least = dims.preferred_file_version_for_point_format(new.point_format.id)
        new.version = max(version.from_str(least), version(1, min(new.version.minor, 4)))
    return new


def _write_evlrs(writer: laspy.LasWriter, header: CheckedHeader) -> None:
    from laspy.vlrs.vlrlist import VLRList

    kept = [_as_stored(e) for e in header.evlrs if not _is_octree(header, e.user_id)]
    if kept:
        writer.write_evlrs(VLRList(kept))


def _as_stored(record: Vlr) -> laspy.VLR:
    """A record with the bytes of the file: laspy changes those that it understands."""
    import laspy

    return laspy.VLR(record.user_id, record.record_id, record.description, record.data)


def _is_own(dimension: laspy.DimensionInfo) -> bool:
    return dimension.description.startswith(OWN_MARK)


def _is_octree(header: CheckedHeader, user_id: str) -> bool:
    """Whether a record belongs to COPC: those list the byte at which each octree cell starts, which
    changes."""
    return header.format == "copc" and user_id == "copc"


def _check_can_be_kept(header: CheckedHeader, names: set[str]) -> None:
    """Refuse content that laspy would change when it writes it."""
    foreign = [d for d in header.las.point_format.extra_dimensions if not _is_own(d)]
    for name in names & {d.name for d in foreign}:
        raise InputError(
            f"the survey already has a dimension {name!r} that scenenet did not write",
            file=header.path,
            remedy="Rename or remove it first (pdal translate --writers.las.extra_dims)",
        )
    records = [*header.las.vlrs, *(header.las.evlrs or ())]
    texts = [r.user_id for r in records] + [e.description for e in header.las.evlrs or ()]
    if not all(isinstance(text, str) and text.isascii() for text in texts):
        raise InputError(
            "the name or description of a record is not ASCII, which laspy cannot write",
            file=header.path,
            remedy="Rewrite the survey with another tool (pdal translate, las2las)",
        )
    if header.waveforms_inside:
        raise InputError(
            "its waveforms are stored inside the file, so dimensions cannot be added",
            file=header.path,
            remedy="Write the points without waveforms first (pdal translate "
            "--writers.las.dataformat_id, las2las -set_point_type)",
        )


def _check_channels(source: Path, channels: set[int], compressed: bool) -> None:
    if compressed and len(channels) > 1:
        raise InputError(
            "its points have waveform packets of several scanner channels, which the compressor "
            "would mix up",
            file=source,
            remedy="Choose a .las file for the result, or write the points without waveforms first "
            "(pdal translate --writers.las.dataformat_id, las2las -set_point_type)",
        )
