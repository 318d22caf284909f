"""Several models at once, and models that find no towers."""

from __future__ import annotations

import csv
import json
import sqlite3
from pathlib import Path

import laspy
import numpy as np
import pytest
from fixtures.scenes import model_card

from scenenet.core.errors import InputError
from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.detection.settings import DetectionSettings
from scenenet.models.model_file import write_model
from scenenet.models.predictions import probabilities
from scenenet.models.scenenet import SceneNet
from scenenet.pointcloud import class_scheme, read
from scenenet.prediction import predict as predict_module
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.work import work_file
from scenenet.prediction.writers import predict_to_files

LONE_POLES = DetectionSettings(min_conductor=0)
FINE = 0.7
"""Voxels of the second model, m."""


@pytest.fixture(scope="module")
def wire(pole_finder, tmp_path_factory) -> Path:
    """A model of wires in finer voxels than those of ``model``; it responds to poles."""
    path = tmp_path_factory.mktemp("wire") / "wire.json"
    found, _ = pole_finder
    write_model(path, found, model_card(name="wires", target="wire", voxel_size=FINE, tau=0.5))
    return path


def predict(survey: Path, models, folder: Path, scheme: str | None = None, **settings):
    towers = not isinstance(models, Path) or "wire" not in models.name
    files = PredictionFiles.of(SurveyFiles.of(survey), folder, towers=towers)
    codes = None if scheme is None else class_scheme(scheme)
    used = PredictSettings(**settings)
    summary = predict_to_files(survey, models, files, used, LONE_POLES, scheme=codes)
    return files, summary


@pytest.fixture(scope="module")
def each(line, model, wire, tmp_path_factory):
    """The results of both models at once, of the towers alone, and of the wires alone."""
    folder = tmp_path_factory.mktemp("each")
    chosen = {"both": [wire, model], "towers": model, "wires": wire}
    return {name: predict(line, models, folder / name) for name, models in chosen.items()}


def points(files: PredictionFiles) -> laspy.LasData:
    [path] = files.points.values()
    return laspy.read(path)


def test_models_at_once_give_what_each_gives_alone(each):
    both, towers, wires = (points(each[name][0]) for name in ("both", "towers", "wires"))
    geneos = ("cylinder", "arrow", "negative_sphere")
    own = ["tower_probability", "tower_id", *(f"share_{geneo}" for geneo in geneos)]
    others = ["wire_probability", *(f"wire_{geneo}" for geneo in geneos)]
    assert list(towers.point_format.extra_dimension_names) == own
    assert list(wires.point_format.extra_dimension_names) == others
    of_the_line = ["span_id", "conductor_id"]
    assert list(both.point_format.extra_dimension_names) == own + others + of_the_line
    for name, alone in [*((n, towers) for n in own), *((n, wires) for n in others)]:
        np.testing.assert_array_equal(both[name], alone[name])
    assert both["tower_id"].max() > 0 and both["wire_probability"].max() > 0.5
    for kind in ("table", "geojson"):  # the page of both shows the line as well
        one, other = (getattr(each[name][0], kind).read_bytes() for name in ("both", "towers"))
        assert one == other, kind


def test_a_second_model_sees_its_own_voxels_of_every_point(each, line, pole_finder):
    cloud = read(line)
    grid = VoxelGrid.on_map(cloud.xyz, FINE)
    labelled = voxelise(read(line, "edp"), grid)
    expected, _ = probabilities(pole_finder[0], labelled, "presence")
    found = points(each["both"][0])["wire_probability"]
    np.testing.assert_allclose(found, expected[grid.voxel_of(cloud.xyz)], atol=1e-5)


def test_a_survey_is_decoded_once_for_all_models(line, model, wire, tmp_path, monkeypatch):
    read_by = []
    iter_chunks = work_file.iter_chunks
    monkeypatch.setattr(
        work_file, "iter_chunks", lambda *a, **k: read_by.append(a) or iter_chunks(*a, **k)
    )
    with predict_module.predict_survey(line, [model, wire], PredictSettings(), LONE_POLES):
        assert len(read_by) == 1


def test_without_a_model_of_towers_nothing_looks_like_a_list_of_towers(each):
    files, summary = each["wires"]
    assert (files.table, files.geojson, files.page) == (None, None, None)
    written = {path.name for path in files.summary.parent.iterdir()}
    assert written == {"line.laz", "line.gpkg", "line.summary.json"}
    assert summary.towers is None
    with sqlite3.connect(files.geopackage) as database:
        layers = database.execute("SELECT table_name FROM gpkg_contents").fetchall()
        columns = [row[1] for row in database.execute("PRAGMA table_info(tiles)")]
    assert ("towers",) not in layers and ("coverage",) in layers
    assert "wire_points" in columns and "towers" not in columns


def test_the_summary_says_what_each_model_found(each):
    summary = json.loads(each["both"][0].summary.read_text())
    tower, wires = summary["targets"]
    data = points(each["both"][0])
    assert (tower["target"], tower["points"]) == ("tower", int((data["tower_id"] > 0).sum()))
    taken = int((data["wire_probability"] >= 0.5).sum())
    assert (wires["target"], wires["points"]) == ("wire", taken)
    assert (wires["model"], wires["tau"], wires["voxel_size_m"]) == ("wires", 0.5, FINE)
    [file] = summary["files"]
    assert (file["wire_points"], file["tower_points"]) == (taken, tower["points"])


@pytest.mark.parametrize("changed", [False, True])
def test_a_list_of_an_earlier_prediction_is_no_result_of_one_without_towers(
    line, model, wire, tmp_path, changed, capsys
):
    before, _ = predict(line, model, tmp_path)
    if changed:  # it is no longer ours
        before.table.write_text("mine")
    predict(line, wire, tmp_path)
    assert not before.geojson.exists() and not before.page.exists()
    assert before.table.exists() == changed
    assert "removed, because no towers were looked for this time" in capsys.readouterr().err


@pytest.mark.parametrize(("scheme", "code"), [("edp", 16), ("asprs", 14)])
def test_points_of_wires_that_are_in_no_tower_get_their_class(
    line, model, wire, tmp_path, scheme, code
):
    files, _ = predict(line, [model, wire], tmp_path, scheme, classify=True)
    before, after = laspy.read(line), points(files)
    tower = after["tower_id"] > 0
    taken = (after["wire_probability"] >= np.float32(0.5)) & ~tower
    assert taken.sum() > 10
    expected = np.where(tower, 15, np.where(taken, code, np.asarray(before.classification)))
    np.testing.assert_array_equal(after.classification, expected)


def test_only_chosen_codes_are_replaced(line, model, wire, tmp_path, each):
    before, both = np.asarray(laspy.read(line).classification), points(each["both"][0])
    taken = (both["wire_probability"] >= np.float32(0.5)) & (both["tower_id"] == 0)
    chosen = int(np.bincount(before[taken]).argmax())
    files, _ = predict(
        line, [model, wire], tmp_path, "asprs", classify=True, classify_from=(chosen,)
    )
    changed = points(files).classification != before
    assert changed.any() and (before[changed] == chosen).all()


def test_a_survey_of_tiles_has_the_same_points_of_wires(
    line, line_with_a_broken_file, model, wire, tmp_path, each
):
    files, summary = predict(line_with_a_broken_file, [model, wire], tmp_path)
    parts = {path.stem: laspy.read(path) for path in files.points.values() if path.exists()}
    whole = points(each["both"][0])
    assert len(parts) == 2
    for part in parts.values():
        rows = {tuple(xyz): at for at, xyz in enumerate(whole.xyz.round(3).tolist())}
        at = [rows[tuple(xyz)] for xyz in part.xyz.round(3).tolist()]
        # Points at one place are in one voxel.
        np.testing.assert_array_equal(part["wire_probability"], whole["wire_probability"][at])
    with files.status.open() as stream:
        status = {row["file"]: row for row in csv.DictReader(stream)}
    assert sum(int(row["wire_points"]) for row in status.values()) == summary.targets[1]["points"]


def test_a_run_that_was_stopped_predicts_no_tile_again(
    line_with_a_broken_file, model, wire, tmp_path, monkeypatch
):
    def stopped(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr("scenenet.prediction.writers.write_tiles", stopped)
        predict(line_with_a_broken_file, [model, wire], tmp_path)
    monkeypatch.setattr(predict_module, "predict_file", stopped)
    monkeypatch.setattr(predict_module, "read_file", stopped)
    _, summary = predict(line_with_a_broken_file, [model, wire], tmp_path)
    assert summary.targets[1]["points"] > 0


def refused(line, models, folder) -> str:
    with pytest.raises(InputError) as error:
        predict(line, models, folder)
    assert not any(folder.glob("*.laz"))
    return str(error.value)


def test_two_models_of_one_target_are_refused(line, model, wire, tmp_path):
    message = refused(line, [model, wire, wire], tmp_path)
    assert "it finds wire, and so does" in message
    assert "Name one model for each target" in message


def test_a_dimension_that_las_cannot_name_is_refused(line, tmp_path, pole_finder):
    found = SceneNet(["negative_sphere"])
    path = tmp_path / "long.json"
    write_model(path, found, model_card(target=f"{'l' * 20}=14"))
    assert "would have 36 bytes, and LAS allows 32" in refused(line, [path], tmp_path)


def test_a_list_of_towers_needs_a_model_of_towers(line, wire, tmp_path):
    files = PredictionFiles.of(line, tmp_path)
    with pytest.raises(InputError, match="a list of towers needs a model of towers"):
        predict_to_files(line, wire, files, PredictSettings(), LONE_POLES)
