"""The report on a survey: facts, class densities (thesis Table 5.1) and warnings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.pointcloud.quality.codes import in_words

if TYPE_CHECKING:
    import pandas as pd

MANY_DUPLICATES = 0.001
"""Share of duplicated points above which there is a warning."""


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


def about_points(facts: dict[str, Any]) -> list[str]:
    """What is odd about the points of a survey, as sentences, from the facts of its report."""
    n = facts["n_points"]
    warnings = []
    if facts["stray_points"]:
        warnings.append(f"stray coordinates: {in_words(facts['stray_points'])} far from all others")
    if facts["duplicated_points"] > MANY_DUPLICATES * n:
        about = "about " if facts["duplicates_estimated"] else ""
        warnings.append(
            f"duplicates: {about}{in_words(facts['duplicated_points'])} "
            f"({100 * facts['duplicated_points'] / n:.1f} %) have the coordinates of another point"
        )
    counted = (
        ("points_outside_header_box", "outside the bounding box in the header"),
        ("points_without_gps_time", "with a GPS time that is not a number (the time is not used)"),
        ("impossible_returns", "with an impossible return number (the number is not used)"),
        ("withheld_points", "marked as withheld by the producer (they are kept)"),
    )
    return warnings + [f"{in_words(facts[key])} {text}" for key, text in counted if facts[key]]
