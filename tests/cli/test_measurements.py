"""Models whose measurement is a file outside the package, or needs fields of the points."""

from __future__ import annotations

import json

import laspy
import numpy as np
import pytest
from fixtures.measurement_file import BRIGHT

from scenenet.core.provided_code import MEASUREMENTS

pytestmark = pytest.mark.usefixtures("nothing_provided")

SIGN, POST = 14, 6


def street(path, seed, bright=60_000):
    """Posts in a row, every second of which is a sign that reflects."""
    rng = np.random.default_rng(seed)
    ground = rng.uniform((0, 0, 0), (60, 20, 0.1), (1500, 3))
    xyz, codes, intensity = [ground], [np.full(1500, 2)], [np.full(1500, bright // 30)]
    for number in range(6):
        x = 10 * number + 5
        xyz.append(np.column_stack([rng.normal((x, 10), 0.05, (120, 2)), rng.uniform(0, 8, 120)]))
        codes.append(np.full(120, SIGN if number % 2 else POST))
        intensity.append(np.full(120, bright if number % 2 else bright // 20))
    las = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
    las.header.scales, las.header.offsets = [0.001] * 3, [530_000, 4_630_000, 0]
    las.xyz = np.concatenate(xyz) + las.header.offsets
    las.classification = np.concatenate(codes)
    las.intensity = np.concatenate(intensity)
    las.return_number[:], las.number_of_returns[:] = 1, 1
    las.write(path)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("streets")
    street(folder / "a.laz", 1)
    street(folder / "b.laz", 2)
    street(folder / "dark.laz", 2, bright=0)
    (folder / "bright.py").write_text(BRIGHT)
    return folder


def train(call, files, out, measurement, *more):
    trained = call(
        "train", files / "a.laz", "--codes", "asprs", "--target", f"sign={SIGN}", "--geneos",
        "cylinder", "--protocol", "thesis", "--epochs", "15", "--seeds", "1", "--validation", "0",
        "--voxel-size", "1", "--measurement", measurement, "--out", out, *more,
    )  # fmt: skip
    assert trained.code == 0, trained.err


@pytest.fixture(scope="module")
def model(files, tmp_path_factory):
    return tmp_path_factory.mktemp("models") / "signs.json"


def test_a_measurement_outside_the_package_by_command_line(files, model, tmp_path, call):
    phi = ("--measurements", files / "bright.py")
    train(call, files, model, "bright", *phi)
    record = json.loads(model.read_text())
    assert record["measurement"] == "bright"
    assert record["measurement_source"]["file"] == "bright.py"

    call("predict", files / "b.laz", "--model", model, *phi, "--out", tmp_path)
    las = laspy.read(tmp_path / "b.laz")
    found = np.asarray(las["sign_probability"])
    # phi is 0 at the posts, which have the same shape, and nothing bright is near them.
    assert found[las.classification == POST].max() == 0
    assert found[las.classification == SIGN].mean() > record["tau"]

    scores = json.loads(
        call("evaluate", files / "b.laz", "--codes", "asprs", "--model", model, *phi, "--fit",
             "metric", "--json").out
    )  # fmt: skip
    assert scores["points"]["n_predicted"] == int((found >= np.float32(record["tau"])).sum())
    assert scores["points"]["recall"] > 0.5

    said = call("geneo", "certify", "--model", model, *phi).out
    assert "yes  the measurement lies in [0, 1]" in said


def test_what_is_missing_is_said(files, model, tmp_path, call, monkeypatch):
    phi = ("--measurements", files / "bright.py")
    out = ("--out", tmp_path)
    if not model.exists():
        train(call, files, model, "bright", *phi)
    failed = call("predict", files / "dark.laz", "--model", model, *phi, *out)
    assert failed.code == 1 and "dark.laz: it has no intensity, which the measurement" in failed.err
    monkeypatch.setenv(MEASUREMENTS.variable, "")
    failed = call("predict", files / "b.laz", "--model", model, *out)
    assert failed.code == 1 and "needs the measurement 'bright' of the file bright.py" in failed.err
    changed = tmp_path / "bright.py"
    changed.write_text("raise RuntimeError('this must not run')")
    failed = call("predict", files / "b.laz", "--model", model, "--measurements", changed, *out)
    assert failed.code == 1 and "bright.py is another one" in failed.err
    wrong = call("train", files / "a.laz", "--codes", "asprs", "--measurement", "brigth", "--out",
                 tmp_path / "m.json")  # fmt: skip
    assert wrong.code == 2 and "is not one of the measurements" in wrong.err


@pytest.mark.parametrize("measurement", ["last_returns", "height"])
def test_a_survey_in_tiles_is_measured_as_the_whole_one(files, tmp_path, call, measurement):
    model = tmp_path / "m.json"
    train(call, files, model, measurement)
    whole = laspy.read(files / "b.laz")
    rng = np.random.default_rng(0)
    whole.number_of_returns[:] = rng.integers(1, 3, len(whole.points))
    whole.write(tmp_path / "whole.laz")
    (tmp_path / "tiles").mkdir()
    east = np.asarray(whole.x) > 530_000 + 25.4
    for name, rows in (("west", ~east), ("east", east)):
        part = laspy.LasData(whole.header)
        part.points = whole.points[rows].copy()
        part.write(tmp_path / "tiles" / f"{name}.laz")
    out = tmp_path / "out"
    call("predict", tmp_path / "whole.laz", tmp_path / "tiles", "--model", model, "--out", out)
    found = np.asarray(laspy.read(out / "whole.laz")["sign_probability"])
    for name, rows in (("west", ~east), ("east", east)):
        tile = laspy.read(out / "tiles" / f"{name}.laz")
        np.testing.assert_array_equal(tile["sign_probability"], found[rows])
    assert len(np.unique(found)) > 20
