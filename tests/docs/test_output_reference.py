"""The parts of ``docs/reference/output.md`` that the small run of the tests does not write."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from fixtures.output_reference import Described, described

from scenenet.clearance.records import (
    CLEARANCE_COLUMNS,
    PROFILE_COLUMNS,
    SPAN_CLEARANCE_COLUMNS,
    TREE_COLUMNS,
)
from scenenet.experiments.components import run as components
from scenenet.experiments.components.summary import summarise_components
from scenenet.experiments.cross_validation.run import COLUMNS
from scenenet.experiments.cross_validation.summary import summarise_folds
from scenenet.line.notes import NOTE_COLUMNS
from scenenet.line.records import CONDUCTOR_COLUMNS, SPAN_COLUMNS, SUPPORT_COLUMNS
from scenenet.prediction.point_dimensions import LINE_DIMENSIONS


@pytest.fixture(scope="module")
def page(project_root: Path) -> dict[str, Described]:
    return {d.heading: d for d in described(project_root / "docs" / "reference" / "output.md")}


def test_the_runs_of_a_cross_validation_are_described(page):
    kind = page["cross_validation/MODEL/runs.csv"]
    assert kind.lacks(COLUMNS) == set()
    assert kind.invents(COLUMNS) == set()


def test_the_table_of_a_cross_validation_is_described(page):
    row = dict.fromkeys(COLUMNS, 1) | {"model": "a", "crops": "one two", "alive": True}
    if "voxels" in row:
        row["voxels"] = "whole towers"
    table = summarise_folds(pd.DataFrame([row, row | {"seed": 2}]))
    kind = page["tables/cross_validation.csv"]
    assert kind.lacks(table.columns) == set()
    assert kind.invents(table.columns) == set()


def test_runs_and_table_of_the_parts_of_the_method_are_described(page):
    row = dict.fromkeys(components.COLUMNS, 1) | {"model": "a", "rules": "b", "crops": "c d"}
    table = summarise_components(pd.DataFrame([row, row | {"seed": 2}]))
    for heading, columns in (
        ("components/SOURCE/runs.csv", components.COLUMNS),
        ("tables/components.csv", table.columns),
    ):
        assert page[heading].lacks(columns) == set()
        assert page[heading].invents(columns) == set()


@pytest.mark.parametrize(
    ("heading", "columns"),
    [
        ("SURVEY.spans.csv", SPAN_COLUMNS),
        ("SURVEY.conductors.csv", CONDUCTOR_COLUMNS),
        ("SURVEY.gpkg, layer supports", SUPPORT_COLUMNS),
        ("SURVEY.gpkg, layer line_notes", NOTE_COLUMNS),
        ("SURVEY.clearances.csv", SPAN_CLEARANCE_COLUMNS),
        ("SURVEY.gpkg, layer clearances", CLEARANCE_COLUMNS),
        ("SURVEY.gpkg, layer fall_trees", TREE_COLUMNS),
        ("SURVEY.gpkg, layer clearance_profile", PROFILE_COLUMNS),
    ],
)
def test_the_tables_of_a_line_are_described(page, heading, columns):
    kind = page[f"predict/SURVEY/{heading}"]
    names = [c.name for c in columns]
    assert kind.lacks(names) == set()
    assert kind.invents(names) == set()


def test_the_dimensions_of_a_line_are_described(page):
    assert page["predict/SURVEY/SURVEY.laz"].lacks(LINE_DIMENSIONS) == set()


def test_a_missing_column_would_be_noticed(page):
    assert page["tables/models.csv"].lacks(["model", "f05_std", "thesis_miou", "nothing"]) == {
        "nothing"
    }
    assert page["tables/models.csv"].invents(["model"]) >= {"SCORE", "n_seeds"}
