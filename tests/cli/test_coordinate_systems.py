"""Surveys in feet, and ``--crs`` for files that state no system."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import laspy
import pyogrio
import pyproj
import pytest

from scenenet.pointcloud import PointCloud, read, write_las

FOOT = 0.3048
UTM, FEET = "EPSG:32629", "EPSG:2992"


@pytest.fixture
def in_feet(pole_survey) -> Path:
    """The survey of a pole, in feet, without a system."""
    cloud, path = read(pole_survey), pole_survey.with_name("feet.laz")
    write_las(path, PointCloud(cloud.xyz / FOOT, cloud.classification), scale=1e-4)
    return path


def tower(folder: Path, name: str) -> dict[str, str]:
    with (folder / f"{name}.towers.csv").open(newline="") as stream:
        [row] = csv.DictReader(stream)
    return row


def predict(call, *arguments: object):
    return call("predict", *arguments, "--min-conductor", 0)


def test_the_given_system_is_that_of_every_result(call, pole_survey, pole_model, tmp_path):
    out = tmp_path / "out"
    done = predict(call, pole_survey, "--model", pole_model, "--out", out, "--crs", UTM)
    assert done.code == 0, done.err
    assert "taken to be in WGS 84 / UTM zone 29N, as given" in done.err
    assert "taken to be in metres" not in done.err
    assert json.loads((out / "field.summary.json").read_text())["crs"] == UTM
    assert pyproj.CRS(pyogrio.read_info(out / "field.gpkg", layer="towers")["crs"]) == UTM
    geojson = json.loads((out / "field.towers.geojson").read_text())
    row = tower(out, "field")
    degrees = pyproj.Transformer.from_crs(UTM, 4326, always_xy=True)
    [feature] = geojson["features"]
    assert feature["geometry"]["coordinates"][:2] == pytest.approx(
        degrees.transform(float(row["x"]), float(row["y"]))
    )
    assert "coordinates" not in geojson
    assert laspy.read(out / "field.laz").header.parse_crs() == pyproj.CRS(UTM)
    assert laspy.read(pole_survey).header.parse_crs() is None


def test_the_given_system_says_that_a_survey_is_in_feet(
    call, pole_survey, in_feet, pole_model, tmp_path
):
    out = tmp_path / "out"
    assert predict(call, pole_survey, "--model", pole_model, "--out", out).code == 0
    done = predict(call, in_feet, "--model", pole_model, "--out", out, "--crs", FEET)
    assert done.code == 0, done.err
    metres, feet = tower(out, "field"), tower(out, "feet")
    for name in ("x", "y", "height", "base"):
        assert float(feet[name]) * FOOT == pytest.approx(float(metres[name]), abs=0.1), name
    assert feet["id"] == metres["id"]
    assert json.loads((out / "feet.summary.json").read_text())["units"] == ["foot"] * 3


def test_towers_that_are_too_high_raise_the_question_of_feet(
    call, pole_survey, in_feet, pole_model, tmp_path
):
    said = {}
    for survey in (pole_survey, in_feet):
        done = predict(call, survey, "--model", pole_model, "--out", tmp_path / survey.stem)
        assert done.code == 0, done.err
        said[survey] = "If the coordinates are in feet, name the system with --crs" in done.err
    assert said == {pole_survey: False, in_feet: True}


def test_an_explanation_is_in_the_units_of_the_survey(
    call, pole_survey, in_feet, pole_model, tmp_path
):
    page = tmp_path / "why.html"
    explain = ("--model", pole_model, "--min-conductor", 0, "--json", "--overwrite")
    [metres] = json.loads(call("explain", pole_survey, "--out", page, *explain).out)
    assert "height [m]" in page.read_text()
    done = call("explain", in_feet, "--out", page, "--crs", FEET, *explain)
    assert done.code == 0, done.err
    [feet] = json.loads(done.out)
    assert (feet["unit"], feet["vertical_unit"], metres["unit"]) == ("foot", "foot", "metre")
    for name in ("x", "y", "height"):
        assert feet[name] * FOOT == pytest.approx(metres[name], abs=0.1), name
    assert len(feet["doubts"]) == len(metres["doubts"])
    text = page.read_text()
    assert all(label in text for label in ("x [ft]", "height [ft]", "Its axes are in m."))
    # The picture has the points within a tower's height in metres, not in feet.
    assert "14 m high" in text


def test_a_contradiction_stops_only_its_file(call, pole_survey, pole_model, tmp_path):
    tiles = tmp_path / "tiles"
    tiles.mkdir()
    cloud = read(pole_survey)
    for name, crs in (("a", None), ("b", pyproj.CRS(32630)), ("c", pyproj.CRS(32629))):
        write_las(tiles / f"{name}.laz", PointCloud(cloud.xyz, cloud.classification, crs=crs))
    out = tmp_path / "out"
    done = predict(call, tiles, "--model", pole_model, "--out", out, "--crs", UTM)
    assert done.code == 1
    assert "b.laz: the file states WGS 84 / UTM zone 30N, and the system given" in done.err
    with (out / "tiles" / "status.csv").open(newline="") as stream:
        status = {row["file"]: row["status"] for row in csv.DictReader(stream)}
    assert status == {"a.laz": "predicted", "b.laz": "failed", "c.laz": "predicted"}
    checked = call("check", tiles / "*.laz", "--crs", UTM, "--json")
    assert checked.code == 1
    assert [report["epsg"] for report in json.loads(checked.out)] == [32629, 32629]


def test_check_says_what_predict_does_with_feet_and_degrees(
    call, in_feet, pole_survey, pole_model, tmp_path
):
    feet = call("check", in_feet, "--crs", FEET)
    assert feet.code == 0
    assert "the unit of the coordinates is the foot" in feet.out
    assert "scenenet predict and explain convert it" in feet.out
    out = tmp_path / "out"
    assert predict(call, in_feet, "--model", pole_model, "--out", out, "--crs", FEET).code == 0
    cloud, path = read(pole_survey), tmp_path / "degrees.laz"
    xyz = (cloud.xyz - cloud.xyz.mean(axis=0)) * (1e-5, 1e-5, 1.0) + (-8.0, 41.0, 100.0)
    write_las(path, PointCloud(xyz, cloud.classification, crs=pyproj.CRS(4326)), scale=1e-8)
    degrees = call("check", path, in_feet, "--json")
    assert degrees.code == 1
    assert f"error: {path}: it cannot be used: the coordinates are in degrees" in degrees.err
    assert len(json.loads(degrees.out)) == 2
    refused = predict(call, path, "--model", pole_model, "--out", out)
    assert refused.code == 1 and "the coordinates are in degrees" in refused.err


@pytest.mark.parametrize("text", ["EPSG:99999", "no system", "EPSG:5703", "", "field.laz"])
@pytest.mark.parametrize("command", ["predict", "check", "explain"])
def test_what_is_no_system_is_a_wrong_usage(call, pole_survey, pole_model, tmp_path, command, text):
    out = ("--out", tmp_path / "out.html", "--model", pole_model) if command != "check" else ()
    text = str(pole_survey) if text == "field.laz" else text
    done = call(command, pole_survey, "--crs", text, *out)
    assert done.code == 2
    assert "is neither a coordinate system with x and y" in " ".join(
        done.err.replace("│", " ").split()
    )


def test_a_system_may_be_a_file_with_its_wkt(call, pole_survey, tmp_path):
    (tmp_path / "line.prj").write_text(pyproj.CRS(UTM).to_wkt("WKT1_ESRI"))
    done = call("check", pole_survey, "--crs", tmp_path / "line.prj", "--json")
    assert (done.code, json.loads(done.out)[0]["epsg"]) == (0, 32629)
