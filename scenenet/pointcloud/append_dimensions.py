"""Writing an existing survey back with dimensions added, and nothing else changed."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.file_kinds import kind_of
from scenenet.pointcloud.las.extra_dimensions import OWN_MARK, Dimension, checked, new_dimensions
from scenenet.pointcloud.las.header import CheckedHeader, read_header
from scenenet.pointcloud.las.records import coordinates, iter_records
from scenenet.pointcloud.las.writing import NO_DATE, open_writer, write_cloud
from scenenet.pointcloud.reading import read

if TYPE_CHECKING:
    import laspy

CHUNK_POINTS = 500_000
REWRITTEN = {("LASF_Spec", 4), ("laszip encoded", 22204)}
"""Records that laspy writes anew: the description of extra bytes, and of the compression."""
PLAIN_BYTES = 7
"""Bytes that nothing describes come back as dimensions of so many: laspy takes the number of more
for something else (a scale), and cannot read what it wrote."""
MIXED_UP_FORMATS = (9, 10)
"""Formats whose waveform packets lazrs mixes up where a survey has several scanner channels (seen
with 0.8.2: what it reads back is not what it was given)."""
MAX_RECORD, MAX_EXTRA = 0xFFFF, 0xFFFF // 192
"""Most bytes of a point, and most extra dimensions: each has 192 bytes in a record of as many."""
Values = Callable[[np.ndarray], Mapping[str, np.ndarray]]
"""(n, 3) coordinates -> (n,) numbers by name."""


def add_dimensions(
    source: str | Path, target: str | Path, names: Mapping[str, Dimension], values: Values
) -> int:
    """Write a survey back with every point and everything it had, and dimensions added.

    Points keep their order, stored integers, scale and offset and all other dimensions; variable
    length records and CRS are copied. Dimensions that an earlier call added (their description
    says ``scenenet``) are replaced. Memory is bounded by a chunk. A COPC survey comes back as plain
    LAZ, in the order of its file.

    Args:
        source: the survey: LAS, LAZ, COPC, or a .npy / .pt sample (written as ``write_las`` does).
        target: ``.laz`` (or ``.las``) file; appears whole or not at all; may be ``source``.
        names: name -> numpy type, or (type, description of up to 22 characters).
        values: gets (n, 3) float64 coordinates of consecutive points, returns (n,) numbers for
            each name.

    Returns:
        the number of points.

    Raises:
        InputError: the survey cannot be read, has a dimension of such a name from someone else,
            waveforms that could not be kept, or no room for more dimensions.
        ValueError: ``values`` did not return what ``names`` promises.
    """
    source, target = Path(source), Path(target)
    dimensions = new_dimensions(names, own=True)
    if kind_of(source) != "las":
        cloud = read(source)
        arrays = checked(values(cloud.xyz), dimensions, len(cloud))
        write_cloud(target, cloud, dimensions, arrays, 0.001)
        return len(cloud)
    header = read_header(source)
    channels: set[int] = set()
    with open_writer(target, _extended(header, dimensions)) as writer:
        for records in iter_records(header, CHUNK_POINTS):
            if writer.header.point_format.id in MIXED_UP_FORMATS:
                channels.update(np.unique(records["scanner_channel"]).tolist())
                _check_channels(source, channels, writer.header.are_points_compressed)
            arrays = checked(values(coordinates(records)), dimensions, len(records))
            writer.write_points(_widened(records, writer.header, arrays))
        if header.las.evlrs:
            kept = [e for e in header.las.evlrs if not _is_octree(header, e.user_id)]
            writer.write_evlrs(type(header.las.evlrs)(kept))
    return header.las.point_count


def _widened(
    records: laspy.ScaleAwarePointRecord,
    header: laspy.LasHeader,
    arrays: Mapping[str, np.ndarray],
) -> laspy.ScaleAwarePointRecord:
    """``records`` as points of ``header``: their bytes, then the new dimensions."""
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


def _extended(header: CheckedHeader, dimensions: list[laspy.ExtraBytesParams]) -> laspy.LasHeader:
    """The header of the new file: that of the survey with the new dimensions."""
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
    # From the bytes of the file: laspy would write some records other than it read them.
    new.vlrs = [
        laspy.VLR(v.user_id, v.record_id, v.description, v.data)
        for v in header.vlrs
        if (v.user_id, v.record_id) not in REWRITTEN and not _is_octree(header, v.user_id)
    ]
    for record in new.vlrs.get("ExtraBytesVlr"):  # and it forgets a value that means "no data"
        record.extra_bytes_structs = [
            entry if entry.format_name() in {d.name for d in dimensions}
            else entries.get(entry.format_name(), entry)
            for entry in record.extra_bytes_structs
        ]  # fmt: skip
    new.creation_date = new.creation_date or NO_DATE
    # laspy writes LAS from 1.1 on, and no point format in a version that did not have it.
    version, dims = laspy.header.Version, laspy.point.dims
    if new.point_format.id not in dims.VERSION_TO_POINT_FMT.get(str(new.version), ()):
        least = dims.preferred_file_version_for_point_format(new.point_format.id)
        new.version = max(version.from_str(least), version(1, min(new.version.minor, 4)))
    return new


def _is_own(dimension: laspy.DimensionInfo) -> bool:
    return dimension.description.startswith(OWN_MARK)


def _is_octree(header: CheckedHeader, user_id: str) -> bool:
    """Whether a record is one of COPC: they say at which byte of the file each octree cell lies,
    which is no longer so."""
    return header.format == "copc" and user_id == "copc"


def _check_can_be_kept(header: CheckedHeader, names: set[str]) -> None:
    """Refuse what laspy would write other than it is."""
    theirs = [d for d in header.las.point_format.extra_dimensions if not _is_own(d)]
    for name in names & {d.name for d in theirs}:
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
            "its waveforms are inside of the file, where a prediction cannot be added to them",
            file=header.path,
            remedy="Write the points without waveforms first (pdal translate "
            "--writers.las.dataformat_id, las2las -set_point_type)",
        )


def _check_channels(source: Path, channels: set[int], compressed: bool) -> None:
    if compressed and len(channels) > 1:
        raise InputError(
            "its points have waveform packets of several scanner channels, which cannot be "
            "compressed without mixing them up",
            file=source,
            remedy="Name a .las file for the result, or write the points without waveforms first "
            "(pdal translate --writers.las.dataformat_id, las2las -set_point_type)",
        )
