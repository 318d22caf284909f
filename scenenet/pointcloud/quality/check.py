"""Check a survey: its content and its defects. The first stage, and ``scenenet check``.

One pass over the points, in memory that does not grow with the survey. The class densities
correspond to thesis Table 5.1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from scenenet.core.errors import InputError
from scenenet.core.settings import Settings
from scenenet.pointcloud.class_schemes import ClassScheme, class_scheme
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.file_kinds import kind_of
from scenenet.pointcloud.las.header import read_header
from scenenet.pointcloud.las.records import class_codes, coordinates, iter_records
from scenenet.pointcloud.quality.cell_counts import CellCounts, DuplicateCount
from scenenet.pointcloud.quality.report import (
    Corner,
    SurveyFacts,
    SurveyReport,
    about_points,
    class_table,
)
from scenenet.pointcloud.quality.screening import Finding, Screening, of_samples
from scenenet.pointcloud.reading import SurveyInfo, iter_chunks, survey_info
from scenenet.pointcloud.ts40k import sample_files
from scenenet.pointcloud.units import look_like_degrees, not_metres, unit_name

if TYPE_CHECKING:
    import laspy
    import pyproj

METRES_IN_A_DEGREE = 111_320.0


class CheckSettings(Settings):
    """Limits of the check."""

    density_cell: float = Field(
        2.0,
        gt=0,
        description="side of the cells that count as covered if they have a point, m; use "
        "several times the distance between points",
    )
    stray_factor: float = Field(
        3.0,
        gt=0,
        description="a point is stray if, along any axis, it is outside the middle 98 % of the "
        "points by more than this many times their extent",
    )
    stray_share: float = Field(
        0.005,
        ge=0,
        lt=0.5,
        description="largest share of stray points; more than this are part of the survey",
    )
    chunk_points: int = Field(500_000, ge=1, description="points in memory at a time")
    max_cells: int = Field(
        2_000_000,
        ge=1000,
        description="largest number of cells; beyond it the cells become coarser",
    )
    duplicate_sample: int = Field(
        500_000,
        ge=1000,
        description="number of places stored in the search for duplicates; beyond it, their "
        "share is estimated from a sample of places",
    )


@dataclass
class Tally:
    """Counts of one pass over the points.

    Attributes:
        counts: (256,) points of each class code.
        mins, maxs: (3,) extent of the points themselves.
        planar, vertical: points by planar cell and by height.
        duplicates: points with the same coordinates as another.
        outside: points outside the header's bounding box.
        bad_time: points whose GPS time is not a number.
        withheld: points marked as withheld.
        bad_returns: points whose return number is 0 or above the number of returns.
        has_returns: whether any point has a return number at all.
    """

    planar: CellCounts
    vertical: CellCounts
    duplicates: DuplicateCount
    counts: np.ndarray
    mins: np.ndarray
    maxs: np.ndarray
    outside: int = 0
    bad_time: int = 0
    withheld: int = 0
    bad_returns: int = 0
    has_returns: bool = False


def check_survey(
    path: str | Path,
    codes: str | None = None,
    settings: CheckSettings | None = None,
    crs: pyproj.CRS | None = None,
) -> SurveyReport:
    """Read a survey once and report its content and defects.

    Args:
        path: LAS, LAZ, COPC, .npy or .pt file, or a folder of TS40K samples, which are
            checked as one survey.
        codes: class scheme; None if unknown, in which case classes have no names.
        settings: limits of the check.
        crs: the system of the survey if a file states none; None if it is not known.

    Returns:
        the report; defects that do not prevent reading are among its warnings.

    Raises:
        InputError: the survey cannot be read, or states another system than ``crs``.
    """
    settings = settings or CheckSettings()
    path = Path(path)
    scheme = None if codes is None else class_scheme(codes)
    if path.is_dir():
        checked = [_check(sample, scheme, settings, crs) for sample in sample_files(path)]
        return _together(path, checked, scheme)
    return _check(path, scheme, settings, crs)[0]


def raise_if_no_lengths(
    path: str | Path, report: SurveyReport, crs: pyproj.CRS | None = None
) -> None:
    """Refuse a survey that ``scenenet predict`` refuses too. Its report says more.

    Args:
        path: what ``report`` is on.
        crs: as ``check_survey``.

    Raises:
        InputError: the coordinates are known to be no lengths, such as degrees.
    """
    facts = report.facts
    if Path(path).is_dir() or facts.mins is None or facts.maxs is None:
        return
    info = survey_info(path, crs)
    reason = not_metres(info.record, facts.mins, facts.maxs, info.scales)
    if reason and not reason.is_length:
        raise InputError(f"it cannot be used: {reason.problem}", file=str(path))


def _check(
    path: Path, scheme: ClassScheme | None, settings: CheckSettings, crs: pyproj.CRS | None
) -> tuple[SurveyReport, list[Finding]]:
    """The report on one file, and those of its warnings that a folder reports together."""
    info = survey_info(path, crs)
    header = read_header(path) if kind_of(path) == "las" else None
    degrees = _in_degrees(info)
    planar = info.record.planar
    unit = 1.0 if planar is None else planar.metres
    cell = settings.density_cell / (METRES_IN_A_DEGREE if degrees else unit)
    screening = Screening(info, scheme)
    tally = Tally(
        planar=CellCounts(cell, settings.max_cells),
        vertical=CellCounts(settings.density_cell, settings.max_cells),
        duplicates=DuplicateCount(settings.duplicate_sample),
        counts=np.zeros(256, np.int64),
        mins=np.full(3, np.inf),
        maxs=np.full(3, -np.inf),
    )
    if header is None:
        for cloud in iter_chunks(path, chunk_points=settings.chunk_points):
            _add_cloud(tally, cloud)
            screening.add(cloud.xyz, cloud.classification)
    else:
        for records in iter_records(header, settings.chunk_points):
            screening.add(*_add_records(tally, header.las, records))
    findings = screening.findings()
    report = _report(info, degrees, unit, tally, scheme, findings, settings)
    return report, findings


def _in_degrees(info: SurveyInfo) -> bool:
    """Whether planar coordinates are degrees: according to the CRS or, without one, to numbers."""
    if info.crs is not None:
        return bool(info.crs.is_geographic)
    return info.record.planar is None and look_like_degrees(info.mins, info.maxs, info.scales)


def _add_cloud(tally: Tally, cloud: PointCloud) -> None:
    _add(tally, cloud.xyz, cloud.classification)
    # Adding zero gives -0.0 and 0.0, which are the same place, the same bytes.
    tally.duplicates.add((cloud.xyz + 0.0).view(np.uint64))


def _add_records(
    tally: Tally, header: laspy.LasHeader, records: laspy.ScaleAwarePointRecord
) -> tuple[np.ndarray, np.ndarray]:
    """Count points; returns their coordinates (n, 3) and class codes (n,)."""
    xyz, codes = coordinates(records), class_codes(records)
    _add(tally, xyz, codes)
    places = np.column_stack([records[axis] for axis in "XYZ"])
    tally.duplicates.add(places.astype(np.int64).view(np.uint64))
    margin = np.abs(header.scales)
    inside = (xyz >= header.mins - margin) & (xyz <= header.maxs + margin)
    tally.outside += int((~inside.all(axis=1)).sum())
    if "gps_time" in header.point_format.dimension_names:
        tally.bad_time += int((~np.isfinite(records["gps_time"])).sum())
    number = np.asarray(records["return_number"])
    total = np.asarray(records["number_of_returns"])
    tally.withheld += int(np.count_nonzero(records["withheld"]))
    tally.bad_returns += int(((number == 0) | (number > total)).sum())
    tally.has_returns |= bool((number | total).any())
    return xyz, codes


def _add(tally: Tally, xyz: np.ndarray, codes: np.ndarray) -> None:
    tally.counts += np.bincount(codes, minlength=256)
    tally.mins = np.minimum(tally.mins, xyz.min(axis=0))
    tally.maxs = np.maximum(tally.maxs, xyz.max(axis=0))
    tally.planar.add(xyz[:, 0], xyz[:, 1])
    tally.vertical.add(xyz[:, 2])


def _count_stray(tally: Tally, settings: CheckSettings) -> int:
    """Points far from nearly all others; 0 if they are too many to be an accident."""
    total = int(tally.counts.sum())
    if total < 100:
        return 0
    stray = 0
    for cells, axis in ((tally.planar, 0), (tally.planar, 1), (tally.vertical, 0)):
        stray += cells.count_far(axis, settings.stray_factor)
    return stray if stray <= settings.stray_share * total else 0


def _report(
    info: SurveyInfo,
    degrees: bool,
    unit: float,
    tally: Tally,
    scheme: ClassScheme | None,
    findings: Sequence[Finding],
    settings: CheckSettings,
) -> SurveyReport:
    n_points = int(tally.counts.sum())
    area = None
    if n_points and not degrees:
        area = tally.planar.n_cells * (tally.planar.cell * unit) ** 2
    facts = SurveyFacts(
        survey=info.path.name,
        format=info.format,
        version=info.version,
        point_format=info.point_format,
        n_points=n_points,
        mins=_finite(tally.mins),
        maxs=_finite(tally.maxs),
        header_mins=_finite(np.array(info.mins)),
        header_maxs=_finite(np.array(info.maxs)),
        area_m2=area,
        density_per_m2=None if not area else n_points / area,
        crs=None if info.crs is None else info.crs.name,
        epsg=None if info.crs is None else info.crs.to_epsg(),
        unit="degree" if degrees else info.record.planar and unit_name(info.record.planar),
        vertical_unit=info.record.vertical and unit_name(info.record.vertical),
        codes=None if scheme is None else scheme.name,
        extra_dimensions=info.extra_dimensions,
        duplicated_points=tally.duplicates.estimate(n_points),
        duplicates_estimated=tally.duplicates.is_sampled,
        stray_points=_count_stray(tally, settings),
        points_outside_header_box=tally.outside,
        points_without_gps_time=tally.bad_time,
        withheld_points=tally.withheld,
        impossible_returns=tally.bad_returns if tally.has_returns else 0,
    )
    classes = class_table(tally.counts, scheme)
    warnings = [finding.text for finding in findings]
    return SurveyReport(facts, classes, tuple(warnings + about_points(facts)))


SUMMED = (
    "n_points", "duplicated_points", "stray_points", "points_outside_header_box",
    "points_without_gps_time", "withheld_points", "impossible_returns",
)  # fmt: skip


def _together(
    folder: Path,
    checked: Sequence[tuple[SurveyReport, list[Finding]]],
    scheme: ClassScheme | None,
) -> SurveyReport:
    """The report on the samples of a folder as one survey; ``samples`` is their number."""
    reports = [report for report, _ in checked]
    each = [report.facts for report in reports]
    counts = np.zeros(256, np.int64)
    for report in reports:
        counts[report.classes["code"].to_numpy(int)] += report.classes["points"].to_numpy(int)
    sums = {name: sum(getattr(one, name) for one in each) for name in SUMMED}
    area = sum(one.area_m2 for one in each if one.area_m2) or None
    facts = replace(
        each[0],
        **sums,
        survey=folder.name,
        samples=len(each),
        duplicates_estimated=any(one.duplicates_estimated for one in each),
        mins=_outermost(min, [one.mins for one in each]),
        maxs=_outermost(max, [one.maxs for one in each]),
        header_mins=_outermost(min, [one.header_mins for one in each]),
        header_maxs=_outermost(max, [one.header_maxs for one in each]),
        area_m2=area,
        density_per_m2=None if area is None else sums["n_points"] / area,
    )
    by_sample = {report.facts.survey: findings for report, findings in checked}
    warnings = of_samples(by_sample, counts, scheme) + about_points(facts)
    if scheme is not None and any(counts[code] for code in scheme.tower):
        without = [report.facts.survey for report in reports if not _has_tower(report, scheme)]
        if without:
            listed = ", ".join(without[:5]) + (" and more" if len(without) > 5 else "")
            warnings.append(
                f"no point is labelled tower in {len(without)} of {len(each)} samples: {listed}"
            )
    return SurveyReport(facts, class_table(counts, scheme), tuple(warnings))


def _has_tower(report: SurveyReport, scheme: ClassScheme) -> bool:
    classes = report.classes
    return bool(classes.loc[classes["code"].isin(scheme.tower), "points"].sum())


def _outermost(of: Callable[..., float], corners: Sequence[Corner | None]) -> Corner | None:
    """The smallest or largest x, y and z of the known corners."""
    known = [corner for corner in corners if corner is not None]
    if not known:
        return None
    x, y, z = (of(values) for values in zip(*known, strict=True))
    return x, y, z


def _finite(corner: np.ndarray) -> Corner | None:
    x, y, z = corner.tolist()
    return (x, y, z) if np.isfinite(corner).all() else None
