"""The report on a survey: facts, class densities (thesis Table 5.1) and warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.pointcloud.las.crs import CrsRecord

if TYPE_CHECKING:
    import pandas as pd

FLAG_BITS = 0x1F
MANY_DUPLICATES = 0.001
"""Share of duplicated points above which there is a warning."""
MANY_CODES = 8
"""Undefined codes that a warning lists one by one."""


@dataclass(frozen=True)
class SurveyReport:
    """The result of a check.

    Attributes:
        facts: plain numbers and names, as written to JSON; lengths are in metres if the name says
            so, coordinates are in the unit of the survey.
        classes: one row per class of the scheme and per code found; columns code, class, points,
            share_percent (of all points).
        warnings: defects, the most important first; the survey can be read in spite of them.
    """

    facts: dict[str, Any]
    classes: pd.DataFrame
    warnings: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Everything, as plain data for JSON."""
        rows = [
            {
                "code": int(row.code),
                "class": row.name_,
                "points": int(row.points),
                "share_percent": float(row.share_percent),
            }
            for row in self.classes.rename(columns={"class": "name_"}).itertuples()
        ]
        return {**self.facts, "classes": rows, "warnings": list(self.warnings)}

    def text(self) -> str:
        """A table for the terminal."""
        facts = self.facts
        version = f" {facts['version']}" if facts["version"] else ""
        kind = f", point format {facts['point_format']}" if facts["version"] else ""
        lines = [f"{facts['survey']}: {facts['format'].upper()}{version}{kind}"]
        lines.append(f"  points   {facts['n_points']:,}".replace(",", " "))
        if facts["mins"]:
            spans = [high - low for low, high in zip(facts["mins"], facts["maxs"], strict=True)]
            extent = " x ".join(f"{span:.6g}" for span in spans)
            lines.append(f"  extent   {extent} {facts['unit'] or '(unit not known)'}")
        if facts["density_per_m2"]:
            lines.append(
                f"  density  {facts['density_per_m2']:.1f} points per m2 over "
                f"{facts['area_m2']:,.0f} m2 with points".replace(",", " ")
            )
        epsg = f" (EPSG:{facts['epsg']})" if facts["epsg"] else ""
        lines.append(f"  CRS      {facts['crs'] or 'none'}{epsg}")
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
    return pd.DataFrame(
        {"code": codes, "class": names, "points": points, "share_percent": 100 * points / total}
    )


def find_warnings(
    facts: dict[str, Any],
    counts: np.ndarray,
    scheme: ClassScheme | None,
    record: CrsRecord,
    from_header: Sequence[str],
) -> list[str]:
    """Defects to consider before the survey is used, as sentences."""
    warnings = list(from_header)
    if not facts["n_points"]:
        return [*warnings, "the survey has no points"]
    if record.crs is None and record.problem is None:
        warnings.append(
            "the file names no coordinate system; its coordinates are taken to be in metres"
        )
    if facts["unit"] == "degree":
        warnings.append(
            "the coordinates are in degrees, but tower detection needs metres; reproject the "
            "survey "
            "to a projected system first"
        )
    elif record.unit_m is not None and abs(record.unit_m - 1) > 1e-9:
        warnings.append(
            f"the unit of the coordinates is the {facts['unit']}, but tower detection needs "
            "metres; "
            "reproject the survey first"
        )
    warnings += _about_points(facts)
    if scheme is not None:
        warnings += _about_classes(facts, counts, scheme)
    return warnings


def _points(n: int) -> str:
    return "1 point" if n == 1 else f"{n} points"


def _about_points(facts: dict[str, Any]) -> list[str]:
    n = facts["n_points"]
    warnings = []
    if facts["stray_points"]:
        warnings.append(f"stray coordinates: {_points(facts['stray_points'])} far from all others")
    if facts["duplicated_points"] > MANY_DUPLICATES * n:
        about = "about " if facts["duplicates_estimated"] else ""
        warnings.append(
            f"duplicates: {about}{_points(facts['duplicated_points'])} "
            f"({100 * facts['duplicated_points'] / n:.1f} %) have the coordinates of another point"
        )
    counted = (
        ("points_outside_header_box", "outside the bounding box in the header"),
        ("points_without_gps_time", "with a GPS time that is not a number (the time is not used)"),
        ("impossible_returns", "with an impossible return number (the number is not used)"),
        ("withheld_points", "marked as withheld by the producer (they are kept)"),
    )
    return warnings + [f"{_points(facts[key])} {text}" for key, text in counted if facts[key]]


def _about_classes(facts: dict[str, Any], counts: np.ndarray, scheme: ClassScheme) -> list[str]:
    warnings = []
    found = np.flatnonzero(counts).tolist()
    unknown = [code for code in found if code not in scheme.classes]
    if unknown:
        listed = ", ".join(f"{code} ({_points(counts[code])})" for code in unknown[:MANY_CODES])
        if len(unknown) > MANY_CODES:
            listed += f" and {len(unknown) - MANY_CODES} more"
        hint = ""
        if all(code & 0x80 and code & FLAG_BITS in scheme.classes for code in unknown):
            real = ", ".join(str(code & FLAG_BITS) for code in unknown)
            hint = f"; they look like {real} with flags in the upper bits"
        warnings.append(f"class scheme {scheme.name} does not define these codes: {listed}{hint}")
    if not any(counts[code] for code in scheme.tower):
        tower = ", ".join(map(str, sorted(scheme.tower)))
        warnings.append(
            f"no point is labelled tower (code {tower} in {scheme.name}): the survey can be "
            "predicted, but not used for training"
        )
    if facts["format"] == "pt" and scheme.name != "ts40k" and max(found) <= 5:
        warnings.append(
            f"all class codes are 5 or below. The .pt samples of TS40K have six merged classes "
            f"(tower 4): use class scheme ts40k, not {scheme.name}"
        )
    return warnings
