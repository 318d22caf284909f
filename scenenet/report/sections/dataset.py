"""The sections on the data: surveys, labelled towers, voxels (thesis 5.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd

from scenenet.pointcloud.quality.report import SurveyReport
from scenenet.report.blocks import Block, Column, Notes, Section, Table, table
from scenenet.report.context import ReportContext
from scenenet.results.folder import Results


def data(context: ReportContext) -> Section | None:
    """Surveys and Table 5.1."""
    checks = context.results.checks()
    blocks: list[Block] = [_survey_list(checks, context.results)] if checks else []
    for survey, report in checks.items():
        if report.warnings:
            blocks.append(Notes(f"Warnings of the check of {survey}", report.warnings))
    classes = context.table("classes")
    if classes is not None:
        columns = [
            Column("code", "code", "count"),
            Column("class", "class"),
            Column("points", "points", "count"),
            Column("share_percent", "share [%]", "percent"),
            Column("lowest_percent", "lowest share [%]", "percent"),
            Column("highest_percent", "highest share [%]", "percent"),
            Column("thesis_percent", "thesis [%]", "percent", published=True),
        ]
        caption = (
            f"Share of each class in all points of {_listed(context.results.surveys)}, with the "
            "shares of thesis Table 5.1. The thesis used strips along lines of EDP in Portugal; "
            "the shares can agree only if the surveys are similar."
        )
        blocks.append(table(classes, columns, caption, "tables/classes.csv"))
    for survey in (*context.results.surveys, *context.results.observed):
        blocks += context.figures_of(survey, "data")
    blocks += context.figures("data")
    return Section("data", "The surveys", blocks) if blocks else None


def towers(context: ReportContext) -> Section | None:
    """Thesis 5.1.2."""
    frame = context.table("towers")
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
        "Towers found by DBSCAN in the points labelled tower: mean and standard deviation over "
        "towers, with the values of thesis 5.1.2. Spacing is the distance to the next tower of the "
        "line."
    )
    blocks: list[Block] = [table(frame.fillna({"unit": ""}), columns, caption, "tables/towers.csv")]
    if (crops := context.table("dataset")) is not None:
        shown = crops.astype({"unit": object}).fillna({"unit": ""})
        blocks.append(table(shown, CROPS, CROPS_CAPTION, "tables/dataset.csv"))
    maps = [f for survey in context.results.surveys for f in context.figures_of(survey, "towers")]
    return Section("towers", "The towers", [*blocks, *maps])


CROPS = (
    Column("property", "property"),
    Column("unit", "unit"),
    Column("counted", "counted", "count"),
    Column("value", "value", "number", "std"),
    Column("lowest", "lowest", "number"),
    Column("highest", "highest", "number"),
    Column("thesis", "thesis", "number", published=True),
    Column("thesis_lowest", "thesis lowest", "number", published=True),
    Column("thesis_highest", "thesis highest", "number", published=True),
)
CROPS_CAPTION = (
    "The crops, and the true towers in them where the truth is known, with the values of thesis "
    "5.1.1 to 5.1.3. The row wrong is the share of mislabelled tower points. The thesis measured "
    "labelled towers, whose bases are wider than the true ones because of wrong labels."
)


def voxels(context: ReportContext) -> Section | None:
    """Thesis 5.1.4."""
    frame = context.table("voxelisation")
    blocks = context.figures("voxels")
    if frame is not None:
        columns = [
            Column("grid", "grid"),
            Column("samples", "crops", "count"),
            Column("seconds", "time per crop", "seconds", "seconds_std"),
            Column("thesis_seconds", "thesis, time per crop", "seconds", published=True),
            Column("occupied_voxels", "occupied voxels", "count"),
            Column("tower_voxels", "tower voxels", "count"),
            Column("tower_share_percent", "tower voxels among the occupied [%]", "share"),
        ]
        caption = (
            "Voxelisation of a crop: mean time without reading files, and mean number of voxels. "
            "The times of the thesis (5.1.4) are for an Intel CPU of the 8th generation, those of "
            "this run for the machine that it ran on."
        )
        blocks = [table(frame, columns, caption, "tables/voxelisation.csv"), *blocks]
    return Section("voxels", "Voxels", blocks) if blocks else None


def _survey_list(checks: Mapping[str, SurveyReport], results: Results) -> Table:
    uses = dict.fromkeys(results.predicted, "classified")
    uses |= dict.fromkeys(results.observed, "training of observers")
    uses |= dict.fromkeys(results.surveys, "training")
    columns = [
        Column("survey", "survey"),
        Column("use", "used for"),
        Column("n_points", "points", "count"),
        Column("area_m2", "area [m²]", "count"),
        Column("density_per_m2", "points per m²", "share"),
        Column("crs", "CRS"),
        Column("codes", "class codes"),
    ]
    facts = [
        {"survey": name, "use": uses[name]}
        | {column.name: getattr(report.facts, column.name) for column in columns[2:]}
        for name, report in checks.items()
    ]
    frame = pd.DataFrame(facts).fillna({"crs": "none", "codes": "not given"})
    return table(
        frame,
        columns,
        "Every survey of the run. Models of towers do not see those that observers are trained on.",
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) if 0 < len(names) <= 6 else f"{len(names)} surveys"
