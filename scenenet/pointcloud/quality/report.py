"""The report on a survey: facts, class densities (thesis Table 5.1) and warnings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.pointcloud.quality.codes import in_words

if TYPE_CHECKING:
    import pandas as pd

CLASS_COLUMNS = ("code", "class", "points", "share_percent")
MANY_DUPLICATES = 0.001
"""Share of duplicated points above which there is a warning."""


Corner = tuple[float, float, float]


@dataclass(frozen=True)
class SurveyFacts:
    """Names and numbers of a survey; coordinates are in its unit.

    Attributes:
        survey: name of the file, or of the folder of samples.
        format, version, point_format: as in ``scenenet.pointcloud.reading.SurveyInfo``.
        n_points: number of points.
        mins, maxs: (x, y, z) extent of the points; None without points.
        header_mins, header_maxs: (x, y, z) extent that the header declares; None if it is not
            finite.
        area_m2: m2, area of the cells that have a point; None for degrees and without points.
        density_per_m2: points per m2 of that area.
        crs, epsg: name and code of the coordinate reference system; None if not known.
        unit, vertical_unit: unit of x and y, and of z; None if not known.
        codes: class scheme; None if none was named.
        extra_dimensions: names of the dimensions beyond those of the point format.
        duplicated_points: number of points at the coordinates of another point.
        duplicates_estimated: whether that number is estimated from a sample of the places.
        stray_points, points_outside_header_box, points_without_gps_time: number of such points.
        withheld_points, impossible_returns: number of such points.
        samples: number of files of a folder; None for a file.
    """

    survey: str
    format: str
    version: str | None
    point_format: int | None
    n_points: int
    mins: Corner | None
    maxs: Corner | None
    header_mins: Corner | None
    header_maxs: Corner | None
    area_m2: float | None
    density_per_m2: float | None
    crs: str | None
    epsg: int | None
    unit: str | None
    vertical_unit: str | None
    codes: str | None
    extra_dimensions: tuple[str, ...]
    duplicated_points: int
    duplicates_estimated: bool
    stray_points: int
    points_outside_header_box: int
    points_without_gps_time: int
    withheld_points: int
    impossible_returns: int
    samples: int | None = None


@dataclass(frozen=True)
class SurveyReport:
    """The result of a check.

    Attributes:
        facts: names and numbers of the survey.
        classes: one row per class of the scheme and per code found; columns code, class, points,
            share_percent (of all points).
        warnings: defects, the most important first; the survey can be read in spite of them.
    """

    facts: SurveyFacts
    classes: pd.DataFrame
    warnings: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """The content of the file; only the report on a folder has ``samples``."""
        facts = asdict(self.facts)
        if facts["samples"] is None:
            del facts["samples"]
        values = {n: list(v) if isinstance(v, tuple) else v for n, v in facts.items()}
        classes = self.classes.to_dict("records")
        return {**values, "classes": classes, "warnings": list(self.warnings)}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> SurveyReport:
        """The report from the result of ``to_json``.

        Raises:
            KeyError, TypeError: a value is missing or unknown.
        """
        import pandas as pd

        values: dict[str, Any] = {}
        for name, value in data.items():
            values[name] = tuple(value) if isinstance(value, list) else value
        classes, warnings = values.pop("classes"), values.pop("warnings")
        table = pd.DataFrame(list(classes), columns=list(CLASS_COLUMNS))
        return cls(SurveyFacts(**values), table, warnings)

    def text(self, path: str | Path | None = None) -> str:
        """A table for the terminal; it begins with the path, or without one with the name."""
        facts = self.facts
        version = f" {facts.version}" if facts.version else ""
        kind = f", point format {facts.point_format}" if facts.version else ""
        lines = [f"{path or facts.survey}: {facts.format.upper()}{version}{kind}"]
        lines.append(f"  points   {facts.n_points:,}")
        if facts.mins and facts.maxs:
            spans = [high - low for low, high in zip(facts.mins, facts.maxs, strict=True)]
            extent = " x ".join(f"{span:.6g}" for span in spans)
            lines.append(f"  extent   {extent} {facts.unit or '(unit not known)'}")
        if facts.density_per_m2 and facts.area_m2:
            lines.append(
                f"  density  {facts.density_per_m2:.1f} points per m2 over "
                f"{facts.area_m2:,.0f} m2 with points"
            )
        epsg = f" (EPSG:{facts.epsg})" if facts.epsg else ""
        lines.append(f"  CRS      {facts.crs or 'none'}{epsg}")
        lines += ["", f"  code  {'class':<38}{'points':>14}  share %"]
        lines += [
            f"  {row.code:>4}  {row[2]:<38}{row.points:>14}  {row.share_percent:7.3f}"
            for row in self.classes[self.classes["points"] > 0].itertuples()
        ]
        if self.warnings:
            lines += ["", *(f"  warning: {warning}" for warning in self.warnings)]
        return "\n".join(lines)


def class_table(counts: np.ndarray, scheme: ClassScheme | None) -> pd.DataFrame:
    """Points and share of each class, including the classes of the scheme without points.

    Args:
        counts: (256,) points of each code.
        scheme: names of the codes; None if unknown.
    """
    import pandas as pd

    known = set() if scheme is None else set(scheme.classes)
    codes = sorted(known | set(np.flatnonzero(counts).tolist()))
    names = [f"code {code}" if scheme is None else scheme.class_name(code) for code in codes]
    points = counts[codes] if codes else np.empty(0, np.int64)
    total = max(int(counts.sum()), 1)
    columns = (codes, names, points, 100 * points / total)
    return pd.DataFrame(dict(zip(CLASS_COLUMNS, columns, strict=True)))


def about_points(facts: SurveyFacts) -> list[str]:
    """What is odd about the points of a survey, as sentences, from the facts of its report."""
    n = facts.n_points
    warnings = []
    if facts.stray_points:
        warnings.append(f"stray coordinates: {in_words(facts.stray_points)} far from all others")
    if facts.duplicated_points > MANY_DUPLICATES * n:
        about = "about " if facts.duplicates_estimated else ""
        warnings.append(
            f"duplicates: {about}{in_words(facts.duplicated_points)} "
            f"({100 * facts.duplicated_points / n:.1f} %) have the coordinates of another point"
        )
    counted = (
        (facts.points_outside_header_box, "outside the bounding box in the header"),
        (
            facts.points_without_gps_time,
            "with a GPS time that is not a number (the time is not used)",
        ),
        (facts.impossible_returns, "with an impossible return number (the number is not used)"),
        (facts.withheld_points, "marked as withheld by the producer (they are kept)"),
    )
    return warnings + [f"{in_words(n)} {text}" for n, text in counted if n]
