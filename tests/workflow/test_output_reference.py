"""``docs/reference/output.md`` describes what a run writes: no file, column, key or dimension is
missing there, and none is superfluous."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from pathlib import Path

import laspy
import pyogrio
import pytest
from fixtures.output_reference import Described, described, description_of

pytestmark = pytest.mark.workflow

ONLY_ELSEWHERE = {
    "sample", "samples", "search", "metric", "evidence", "target", "first", "span_id",
    "conductor_id", "conductor", "span", "z", "measurement_source",
}  # fmt: skip
"""Names of results that this run does not have: those of TS40K folders, of models in metres, of
other targets, of lines and of measurements from outside the package."""
FREE_KEYS = ("mlflow/NAME.json", "config.yaml")
"""Files whose keys are names that the user chose."""


@pytest.fixture(scope="module")
def page(project_root: Path) -> list[Described]:
    return described(project_root / "docs" / "reference" / "output.md")


@pytest.fixture(scope="module")
def written(finished, page) -> dict[str, set[str]]:
    """Heading -> the names in all files of that kind."""
    names: dict[str, set[str]] = defaultdict(set)
    for path in _files(finished.results):
        kind = description_of(str(path.relative_to(finished.results)), page)
        if kind is not None and kind.heading not in FREE_KEYS:
            names[kind.heading] |= set(_names(path))
    return names


def _files(results: Path) -> list[Path]:
    return sorted(path for path in results.rglob("*") if path.is_file())


def _names(path: Path) -> list[str]:
    """Columns of a table, properties of features, keys of a JSON file, added dimensions."""
    if path.suffix in (".csv", ".tsv"):
        with path.open(newline="") as file:
            return next(csv.reader(file, delimiter="\t" if path.suffix == ".tsv" else ","))
    if path.suffix == ".geojson":
        return [n for f in json.loads(path.read_text())["features"] for n in f["properties"]]
    if path.suffix == ".gpkg":
        layers = [name for name, kind in pyogrio.list_layers(path) if kind is not None]
        return [n for layer in layers for n in pyogrio.read_info(path, layer=layer)["fields"]]
    if path.suffix == ".json":
        return list(json.loads(path.read_text()))
    if path.suffix == ".laz":
        with laspy.open(path) as reader:
            return list(reader.header.point_format.extra_dimension_names)
    return []


def test_every_file_is_described(finished, page):
    found = [str(path.relative_to(finished.results)) for path in _files(finished.results)]
    assert len(found) > 100
    assert not [path for path in found if description_of(path, page) is None]


def test_every_name_in_a_file_is_described(page, written):
    assert len(written) > 30
    missing = {d.heading: d.lacks(written[d.heading]) for d in page if d.heading in written}
    assert not {heading: names for heading, names in missing.items() if names}


def test_every_described_name_is_in_a_file(page, written):
    invented = {d.heading: d.invents(written[d.heading]) for d in page if d.heading in written}
    invented = {heading: names - ONLY_ELSEWHERE for heading, names in invented.items()}
    assert not {heading: names for heading, names in invented.items() if names}
