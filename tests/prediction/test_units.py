"""A survey in feet gives the towers of the same survey in metres, in its own units."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import laspy
import numpy as np
import pyogrio
import pyproj
import pytest

from scenenet.detection.settings import DetectionSettings
from scenenet.models.packaged import packaged_model
from scenenet.pointcloud import PointCloud, read, write_las
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.writers import predict_to_files

LONE_POLES = DetectionSettings(min_conductor=0)
FOOT, SURVEY_FOOT = 0.3048, 1200 / 3937
LENGTHS = {"x": 0, "y": 0, "width": 0, "edge_distance": 0, "height": 2, "base": 2}
"""Column of the tower list -> axis that has its unit."""
SYSTEMS = [
    ("EPSG:32629+6360", (1.0, 1.0, SURVEY_FOOT)),  # metres in plan, heights in US survey feet
    ("EPSG:2992", (FOOT, FOOT, FOOT)),  # feet; heights without a unit have that of the plan
    ("EPSG:2229+5703", (SURVEY_FOOT, SURVEY_FOOT, 1.0)),  # heights in metres
]


def predict(cloud: PointCloud, model: Path, folder: Path) -> PredictionFiles:
    folder.mkdir()
    write_las(folder / "line.laz", cloud, scale=1e-4)
    files = PredictionFiles.of(folder / "line.laz", folder / "out")
    predict_to_files(folder / "line.laz", model, files, PredictSettings(), LONE_POLES)
    return files


def rows(files: PredictionFiles) -> list[dict[str, str]]:
    with files.table.open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.parametrize(("system", "sizes"), SYSTEMS)
def test_the_towers_are_the_same_in_every_unit(scene, model, tmp_path, capsys, system, sizes):
    cloud = scene([(15.5, 15.5), (60.5, 15.5)], size=(80.0, 31.0), tree=(40.0, 20.0))
    metres = predict(cloud, model, tmp_path / "metres")
    capsys.readouterr()
    crs = pyproj.CRS(system)
    scaled = PointCloud(cloud.xyz / sizes, cloud.classification, crs=crs)
    files = predict(scaled, model, tmp_path / "units")
    assert (
        "it is converted, and the results are in the units of the survey" in capsys.readouterr().err
    )
    assert len(rows(files)) == len(rows(metres)) == 2
    for tower, same in zip(rows(files), rows(metres), strict=True):
        for name, axis in LENGTHS.items():
            assert float(tower[name]) * sizes[axis] == pytest.approx(float(same[name]), abs=0.1), (
                name
            )
    ours, theirs = (laspy.read(*f.points.values()) for f in (files, metres))
    source = laspy.read(*files.points)
    np.testing.assert_array_equal(ours.X, source.X)
    assert (np.asarray(ours.tower_id) == np.asarray(theirs.tower_id)).mean() > 0.999
    summary = json.loads(files.summary.read_text())
    assert summary["unit_sizes_m"] == pytest.approx(sizes)
    coverage = pyogrio.read_info(files.geopackage, layer="coverage")["total_bounds"]
    assert coverage[0] <= source.x.min() and coverage[2] >= source.x.max()
    geojson = json.loads(files.geojson.read_text())["features"][0]["geometry"]["coordinates"]
    assert geojson[2] == pytest.approx(float(rows(metres)[0]["base"]), abs=0.1)


def test_a_real_survey_in_feet_gives_the_towers_of_the_same_in_metres(real_data, tmp_path):
    survey = real_data / "field" / "autzen_line_w.laz"
    cloud = read(survey)
    metres = tmp_path / "metres.laz"
    write_las(metres, PointCloud(cloud.xyz * FOOT, cloud.classification), scale=1e-4)
    found = []
    for path in (survey, metres):
        files = PredictionFiles.of(path, tmp_path / "out")
        predict_to_files(path, packaged_model(), files, PredictSettings(), DetectionSettings())
        found.append(rows(files))
    assert len(found[0]) == len(found[1]) >= 4
    for tower, same in zip(*found, strict=True):
        for name in LENGTHS:
            length = float(tower[name]) * FOOT
            assert length == pytest.approx(float(same[name]), abs=0.1), name
