"""A model that finds poles, and surveys of poles."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
import pyproj
import pytest
from fixtures import scenes

from scenenet.clearance.settings import ClearanceSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.models.model_file import write_model
from scenenet.pointcloud import PointCloud, write_las
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.writers import predict_to_files

VOLTAGE = 66.0


@pytest.fixture(scope="package")
def model(pole_finder, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("model") / "by-hand.json"
    write_model(path, *pole_finder)
    return path


@pytest.fixture(scope="package")
def line(scene, tmp_path_factory) -> Path:
    """Two poles with conductors between them and beyond, and a lone one; west to east."""
    cloud = scene(
        [(30.5, 15.5), (75.5, 15.5), (130.5, 15.5)], size=(150.0, 31.0), tree=(100.0, 20.0)
    )
    x = np.arange(3.0, 103.0, 0.2)
    wire = np.column_stack([x, np.full(len(x), 15.5), np.full(len(x), 13.8)]) + scenes.PLACE
    codes = np.append(cloud.classification, np.full(len(wire), 16, np.uint8))
    path = tmp_path_factory.mktemp("line") / "line.laz"
    write_las(path, PointCloud(np.concatenate([cloud.xyz, wire]), codes, crs=pyproj.CRS(32629)))
    return path


@pytest.fixture(scope="package")
def line_with_a_broken_file(line, tmp_path_factory) -> Path:
    """A folder with ``line`` in two files, and a file that cannot be read."""
    folder = tmp_path_factory.mktemp("tiles")
    points = laspy.read(line)
    west = np.asarray(points.x) < scenes.PLACE[0] + 50
    for name, part in (("east", ~west), ("west", west)):
        tile = laspy.LasData(points.header)
        tile.points = points.points[part]
        tile.write(folder / f"{name}.laz")
    (folder / "<img src=x onerror=alert(1)> & 'quotes\".laz").write_bytes(b"no survey")
    return folder


@pytest.fixture(scope="package")
def line_page(line, model, tmp_path_factory) -> Path:
    """The page of ``line``, as ``scenenet predict`` writes it."""
    files = PredictionFiles.of(line, tmp_path_factory.mktemp("line-page"))
    predict_to_files(line, model, files, PredictSettings(), DetectionSettings(min_conductor=0))
    return files.page


@pytest.fixture(scope="package")
def wire_finder(tmp_path_factory) -> Path:
    """A model of wires with numbers set by hand."""
    path = tmp_path_factory.mktemp("wires") / "wires.json"
    write_model(path, *scenes.make_wire_finder())
    return path


@pytest.fixture(scope="package")
def line_with_wires(scene, tmp_path_factory) -> Path:
    """Three poles in a row, and a wire to the second one that ends before the third."""
    poles = [(x, 15.5) for x in scenes.POLES_X]
    cloud = scene(poles, size=(150.0, 31.0), tree=(100.0, 20.0))
    ends = scenes.POLES_X[0] - 45.0, *scenes.POLES_X
    places = scenes.wire_points(ends, 15.5, scenes.WIRE_Z, 3.0, 103.0)
    codes = np.append(cloud.classification, np.full(len(places), 16, np.uint8))
    path = tmp_path_factory.mktemp("line_with_wires") / "line.laz"
    write_las(path, PointCloud(np.concatenate([cloud.xyz, places]), codes, crs=pyproj.CRS(32629)))
    return path


@pytest.fixture(scope="package")
def line_results(line_with_wires, model, wire_finder, tmp_path_factory) -> PredictionFiles:
    """The results of ``line_with_wires`` with a voltage."""
    files = PredictionFiles.of(line_with_wires, tmp_path_factory.mktemp("predicted"), line=True)
    predict_to_files(
        line_with_wires, [model, wire_finder], files, PredictSettings(),
        DetectionSettings(min_conductor=0), clearance=ClearanceSettings(voltage=VOLTAGE),
    )  # fmt: skip
    return files
