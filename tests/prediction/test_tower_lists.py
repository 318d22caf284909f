"""The tower list as CSV and GeoPackage, and its class code in the points."""

from __future__ import annotations

import csv
import sqlite3
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pyogrio
import pyproj
import pytest
import shapely
from fixtures.sound_tower import SOUND_TOWER

from scenenet.core.files import sha256
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import read_towers
from scenenet.pointcloud import PointCloud, write_las
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.writers import predict_to_files

LONE_POLES = DetectionSettings(min_conductor=0)
POLE, UNIT = (500_020.5, 4_630_031.5), 32629
VEGETATION, TOWER = 4, 15


@pytest.fixture(scope="module")
def survey(scene, tmp_path_factory) -> Path:
    """A pole that is coded as vegetation, in a CRS."""
    cloud = scene([(20.5, 31.5)], size=(70.0, 60.0), tree=None)
    codes = np.where(cloud.classification == TOWER, VEGETATION, cloud.classification)
    path = tmp_path_factory.mktemp("survey") / "field.laz"
    write_las(path, PointCloud(cloud.xyz, codes, crs=pyproj.CRS(UNIT)))
    return path


def predict(survey: Path, model: Path, folder: Path, **settings) -> PredictionFiles:
    files = PredictionFiles.of(survey, folder)
    predict_to_files(survey, model, files, PredictSettings(**settings), LONE_POLES)
    return files


@pytest.fixture(scope="module")
def files(survey, model, tmp_path_factory) -> PredictionFiles:
    return predict(survey, model, tmp_path_factory.mktemp("found"))


def layer(files: PredictionFiles, name: str) -> tuple[Mapping, np.ndarray, Mapping]:
    """Facts, geometry and columns of a layer."""
    facts, _, geometry, values = pyogrio.raw.read(files.geopackage, layer=name)
    columns = dict(zip(facts["fields"], values, strict=True))
    return facts, shapely.from_wkb(geometry), columns


def test_the_csv_has_the_towers_in_coordinates_of_the_survey(files):
    [tower] = read_towers(files.geojson)
    with files.table.open(newline="") as stream:
        [row] = csv.DictReader(stream)
    assert {"id", "x", "y", "base", "height", "probability"} <= set(row)
    assert (row["x"], row["y"]) == (f"{round(tower.x, 4)}", f"{round(tower.y, 4)}")
    assert (tower.x, tower.y) == pytest.approx(POLE, abs=0.5)
    assert float(row["contribution_cylinder"]) == tower.contributions["cylinder"]
    assert int(row["points"]) == tower.points > 0


def test_the_layer_of_towers_has_the_same_rows_and_the_crs(files):
    [tower] = read_towers(files.geojson)
    facts, [point], columns = layer(files, "towers")
    assert facts["geometry_type"] == "Point Z"
    assert pyproj.CRS(facts["crs"]).to_epsg() == UNIT
    assert (point.x, point.y, point.z) == (tower.x, tower.y, tower.base)
    with files.table.open(newline="") as stream:
        [row] = csv.DictReader(stream)
    assert list(columns) == list(row)
    assert {name: str(values[0]) for name, values in columns.items()} == row


def test_the_coverage_holds_every_point_and_no_wide_gap(files, survey):
    _, polygons, columns = layer(files, "coverage")
    points = laspy.read(survey)
    covered = shapely.union_all(polygons)
    assert shapely.covers(covered.buffer(0.01), shapely.points(points.x, points.y)).all()
    assert sum(columns["area_m2"]) == pytest.approx(70 * 60, rel=0.35)  # cells of 8 m at its edge


def test_the_layer_of_tiles_names_the_file_and_its_status(files, survey):
    _, [extent], columns = layer(files, "tiles")
    assert {name: values[0] for name, values in columns.items()} == {
        "file": "field.laz", "status": "predicted", "points": len(laspy.read(survey)), "towers": 1,
        "tower_points": (laspy.read(*files.points.values())["tower_id"] > 0).sum(), "error": "",
    }  # fmt: skip
    assert extent.covers(shapely.Point(POLE))


def test_qgis_finds_a_style_for_every_layer(files):
    with sqlite3.connect(files.geopackage) as database:
        styles = database.execute(
            "SELECT f_table_name, styleQML FROM layer_styles WHERE useAsDefault"
        ).fetchall()
    assert {name for name, _ in styles} == {"towers", "coverage", "tiles"}
    assert all("<renderer-v2" in style for _, style in styles)


def test_equal_predictions_give_equal_files(files, survey, model, tmp_path):
    again = predict(survey, model, tmp_path)
    for one, other in zip(again.lists, files.lists, strict=True):
        assert sha256(one) == sha256(other), one.name
    assert sha256(*again.points.values()) == sha256(*files.points.values())


def test_a_survey_without_towers_has_empty_lists(scene, model, tmp_path):
    write_las(tmp_path / "flat.laz", scene([], size=(40.0, 40.0), tree=None))
    found = predict(tmp_path / "flat.laz", model, tmp_path / "out")
    assert read_towers(found.geojson) == []
    facts, geometry, columns = layer(found, "towers")
    assert len(geometry) == 0
    assert facts["crs"] is None
    assert columns["id"].dtype == np.int64
    assert found.table.read_text().startswith("id,x,y,height,base,")


def test_class_codes_stay_without_classify(files, survey):
    np.testing.assert_array_equal(
        laspy.read(*files.points.values()).classification, laspy.read(survey).classification
    )


@pytest.mark.parametrize(
    ("chosen", "changes"), [(None, True), ((1, VEGETATION), True), ((1,), False)]
)
def test_classify_gives_the_points_of_towers_code_15(survey, model, tmp_path, chosen, changes):
    found = predict(survey, model, tmp_path, classify=True, classify_from=chosen)
    before, after = laspy.read(survey), laspy.read(*found.points.values())
    codes, tower = np.asarray(after.classification), np.asarray(after["tower_id"]) > 0
    np.testing.assert_array_equal(codes[~tower], np.asarray(before.classification)[~tower])
    body = tower & (np.asarray(before.classification) == VEGETATION)
    assert body.sum() > 50
    assert (codes[body] == (TOWER if changes else VEGETATION)).all()


def test_a_row_has_a_column_for_each_geneo():
    tower = replace(
        SOUND_TOWER,
        conductor_bearings=(12.34, 190.0),
        contributions={"cylinder": 0.75, "arrow": 0.25},
    )
    row = tower.to_row()
    assert row["conductor_bearings"] == "12.3 190.0"
    assert (row["contribution_cylinder"], row["contribution_arrow"]) == (0.75, 0.25)
    assert "contributions" not in row
