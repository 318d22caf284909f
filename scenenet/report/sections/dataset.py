"""The sections on what was learned from: surveys, towers, voxels (thesis 5.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from scenenet.report.blocks import Block, Column, Notes, Section, Table, table
from scenenet.report.context import Material


def data(material: Material) -> Section | None:
    """Surveys and Table 5.1."""
    checks = material.results.checks()
    blocks: list[Block] = [_survey_list(checks)] if checks else []
    for survey, report in checks.items():
        if warnings := [_warning(item) for item in report.get("warnings", [])]:
            blocks.append(Notes(f"The check of {survey} warns", warnings))
    classes = material.table("classes")
    if classes is not None:
        columns = [
            Column("code", "code", "count"),
            Column("class", "class"),
            Column("points", "points", "count"),
            Column("share_percent", "share [%]", "percent"),
            Column("lowest_percent", "lowest survey [%]", "percent"),
            Column("highest_percent", "highest survey [%]", "percent"),
            Column("thesis_percent", "thesis [%]", "percent", published=True),
        ]
        caption = (
            f"Share of each class in all points of {_listed(material.results.surveys)}, beside "
            "thesis Table 5.1. The thesis' data are strips along lines of EDP in Portugal; the "
            "shares agree only as far as the surveys are alike."
        )
        blocks.append(table(classes, columns, caption, "tables/classes.csv"))
    for survey in material.results.surveys:
        blocks += material.figures_of(survey, "data")
    blocks += material.figures("data")
    return Section("data", "The surveys", blocks) if blocks else None


def towers(material: Material) -> Section | None:
    """Thesis 5.1.2."""
    frame = material.table("towers")
    if frame is None:
        return None
    columns = [
        Column("property", "property"),
        Column("unit", "unit"),
        Column("towers", "towers", "count"),
        Column("mean", "mean", "number", "std"),
        Column("lowest", "lowest", "number"),
        Column("highest", "highest", "number"),
        Column("thesis_mean", "thesis mean", "number", published=True),
        Column("thesis_lowest", "thesis lowest", "number", published=True),
        Column("thesis_highest", "thesis highest", "number", published=True),
    ]
    caption = (
        "Towers found by DBSCAN in the points labelled tower, mean and standard deviation over "
        "towers, beside thesis 5.1.2. Spacing is to the next tower along the line."
    )
    maps = [f for survey in material.results.surveys for f in material.figures_of(survey, "towers")]
    return Section("towers", "The labelled towers", [
        table(frame.fillna({"unit": ""}), columns, caption, "tables/towers.csv"), *maps,
    ])  # fmt: skip


def voxels(material: Material) -> Section | None:
    """Thesis 5.1.4."""
    frame = material.table("voxelisation")
    blocks = material.figures("voxels")
    if frame is not None:
        columns = [
            Column("grid", "grid"),
            Column("samples", "crops", "count"),
            Column("seconds", "time a crop", "seconds", "seconds_std"),
            Column("thesis_seconds", "thesis, time a crop", "seconds", published=True),
            Column("occupied_voxels", "occupied voxels", "count"),
            Column("tower_voxels", "tower voxels", "count"),
            Column("tower_share_percent", "towers in the occupied [%]", "share"),
        ]
        caption = (
            "Voxelised crops: mean time without reading files, and mean number of voxels. The "
            "thesis' times (5.1.4) are of an Intel CPU of the 8th generation; ours are of the "
            "machine this ran on."
        )
        blocks = [table(frame, columns, caption, "tables/voxelisation.csv"), *blocks]
    return Section("voxels", "Voxels", blocks) if blocks else None


def _survey_list(checks: Mapping[str, Mapping[str, Any]]) -> Table:
    import pandas as pd

    columns = [
        Column("survey", "survey"),
        Column("n_points", "points", "count"),
        Column("area_m2", "area [m²]", "count"),
        Column("density_per_m2", "points per m²", "share"),
        Column("crs", "CRS"),
        Column("codes", "class codes"),
    ]
    facts = [{"survey": name} | {c.name: report.get(c.name) for c in columns[1:]}
             for name, report in checks.items()]  # fmt: skip
    frame = pd.DataFrame(facts).fillna({"crs": "none", "codes": "not said"})
    return table(frame, columns, "Every survey that was checked, those only classified included.")


def _warning(item: str | Mapping[str, str]) -> str:
    return item if isinstance(item, str) else str(item.get("message", dict(item)))


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) if 0 < len(names) <= 6 else f"{len(names)} surveys"
