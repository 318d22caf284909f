"""The sections on the classified surveys and on provenance."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version

import pandas as pd

from scenenet.core.columns import FieldColumn
from scenenet.core.files import digest
from scenenet.detection.survey_tower import TOWER_COLUMNS, SurveyTower
from scenenet.prediction.summary import PredictionSummary
from scenenet.report.blocks import (
    Block,
    Column,
    Facts,
    Format,
    Heading,
    Link,
    Section,
    Table,
    Text,
    table,
    write,
)
from scenenet.report.context import ReportContext

TOWER_FORMATS: dict[str, Format] = {"m": "metres", "1": "score", "": "count"}
"""How the tower list writes the values of a column, by its unit."""

TOWERS_LISTED = 300
"""Longest list of towers on the page; the files have all towers."""

LIBRARIES = (
    "scenenet",
    "torch",
    "numpy",
    "pandas",
    "laspy",
    "zarr",
    "numba",
    "mlflow",
    "snakemake",
)

SUMMARY_FACTS: tuple[tuple[str, str, Format], ...] = (
    ("points", "points", "count"),
    ("towers", "towers", "count"),
    ("model", "model", "text"),
    ("tau", "tau", "score"),
    ("voxel_size_m", "voxel [m]", "metres"),
    ("seconds", "time", "seconds"),
    ("crs", "CRS", "text"),
)


def predictions(context: ReportContext) -> Section | None:
    """Every classified survey with its towers."""
    blocks: list[Block] = []
    for survey in context.results.predicted:
        found = context.results.prediction(survey)
        if found is None:
            continue
        facts = [
            (label, write(value, how))
            for name, label, how in SUMMARY_FACTS
            if (value := getattr(found.summary, name)) is not None
        ]
        facts += _reviewed(context.results.review_counts(survey))
        blocks += [Heading(survey), Facts(facts)]
        address = context.address(found.page)
        if address is not None:
            blocks.append(Link("Map, list and picture of each tower", address))
        blocks += context.figures_of(survey, "predictions")
        blocks.append(_tower_list(survey, found.towers))
        blocks += _not_predicted(survey, found.summary)
    blocks += _failed(context.failed)
    if not blocks:
        return None
    note = Text(
        "Surveys classified by the model, with the towers it found. The towers have not been "
        "confirmed: review those near the edge of the data or with a low probability. Positions "
        "are in the CRS of the survey; the GeoPackage of each survey opens in any GIS."
    )
    return Section("predictions", "Classified surveys", [note, *blocks])


def _reviewed(counts: Mapping[str, Mapping[str, int]]) -> list[tuple[str, str]]:
    """What people decided about the towers and conductors of a survey; nothing without a review."""
    decided = ("accepted", "rejected", "added", "not_reviewed")
    facts = []
    for what, numbers in counts.items():
        said = (f"{numbers[n]} {n.replace('_', ' ')}" for n in decided if n in numbers)
        facts.append((f"review of {what}", ", ".join(said)))
    return facts


def _not_predicted(survey: str, summary: PredictionSummary) -> list[Block]:
    """The files of a survey that were not predicted, with the reasons."""
    rows = [file for file in summary.files if file["error"]]
    if not rows:
        return []
    columns = [Column("file", "file"), Column("status", "status"), Column("error", "reason")]
    caption = f"{len(rows)} of {len(summary.files)} files of {survey} were not predicted."
    return [table(pd.DataFrame(rows), columns, caption)]


def _failed(failed: Mapping[str, str]) -> list[Block]:
    """The surveys that cannot be used, with the reasons."""
    if not failed:
        return []
    rows = pd.DataFrame(sorted(failed.items()), columns=["survey", "reason"])
    columns = [Column("survey", "survey"), Column("reason", "reason")]
    return [Heading("Failed"), table(rows, columns, "New surveys that cannot be used.")]


def _tower_list(survey: str, towers: Sequence[SurveyTower]) -> Block:
    if not towers:
        return Text(f"No tower was found in {survey}.")
    shown = towers[:TOWERS_LISTED]
    listed = [column for column in TOWER_COLUMNS if column.heading is not None]
    rows = []
    for tower in shown:
        own = {f"share.{name}": 100 * share for name, share in tower.contributions.items()}
        rows.append({column.name: column.value(tower) for column in listed} | own)
    frame = pd.DataFrame(rows)
    columns = [_tower_column(column) for column in listed]
    columns += [
        Column(name, f"{name.removeprefix('share.').replace('_', ' ')} [%]", "share")
        for name in frame.columns
        if name.startswith("share.")
    ]
    caption = f"Towers found in {survey}."
    if len(columns) > len(listed):
        caption += (
            " The last columns are the contributions of each GENEO: positive raises the "
            "probability, negative lowers it."
        )
    if len(towers) > len(shown):
        caption += f" The first {TOWERS_LISTED} of {len(towers)}."
    source = f"predict/{survey}/{survey}.towers.geojson"
    return table(frame, columns, caption, source)


def _tower_column(column: FieldColumn) -> Column:
    heading = str(column.heading) + (" [m]" if column.unit == "m" else "")
    return Column(column.name, heading, TOWER_FORMATS[column.unit])


def provenance(context: ReportContext) -> Section | None:
    """Fingerprints and versions, to reproduce the run."""
    rows = [
        {
            "result": path,
            "stage": made_by.get("stage"),
            "seed": made_by.get("seed"),
            "config": made_by.get("config"),
            "code": made_by.get("code"),
            "inputs": digest(made_by.get("inputs", {})),
            "version": made_by.get("version"),
        }
        for path, made_by in context.results.provenances()
    ]
    blocks: list[Block] = [
        Text(
            "Each result folder has a provenance.json with the settings, the fingerprint of every "
            "input, and the hash of the code that produced it. The table lists them; “inputs” is a "
            "digest of all input fingerprints."
        ),
        Facts([("Python", sys.version.split()[0]), *_versions()]),
    ]
    if rows:
        columns = [
            Column("result", "result"),
            Column("stage", "stage"),
            Column("seed", "seed", "count"),
            Column("config", "config"),
            Column("code", "code"),
            Column("inputs", "inputs"),
            Column("version", "version"),
        ]
        blocks.append(table(pd.DataFrame(rows), columns, "Provenance of each result.", folded=True))
    blocks.append(_published(context))
    return Section("provenance", "Provenance", blocks)


def _versions() -> list[tuple[str, str]]:
    found = []
    for name in LIBRARIES:
        try:
            found.append((name, version(name)))
        except PackageNotFoundError:
            continue
    return found


def _published(context: ReportContext) -> Table:
    """Every published number that this report uses."""
    columns = [
        Column("name", "number"),
        Column("what", "meaning"),
        Column("value", "value", "plain", published=True),
        Column("unit", "unit"),
        Column("place", "place in the thesis"),
    ]
    rows = []
    for name, number in context.thesis.numbers.items():
        bounds = [write(bound, "plain") for bound in (number.low, number.high)]
        value = write(number.value, "plain")
        value += "" if number.spread is None else f" ± {number.spread:g}"
        if number.low is not None or number.high is not None:
            value += f" ({bounds[0]} to {bounds[1]})"
        rows.append([name, number.what or "", value, number.unit or "", number.place])
    return Table(
        f"Published numbers: {context.thesis.source}.", columns, rows, "config/thesis.yaml", True
    )
