"""``train`` and ``evaluate`` for a target other than towers."""

from __future__ import annotations

import json

import laspy
import numpy as np
import pytest
from fixtures.scenes import POLE_TAU, model_card
from pydantic import ValidationError

from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.models.model_file import read_model, write_model
from scenenet.models.predictions import probabilities
from scenenet.models.settings import ModelSettings
from scenenet.pointcloud import PointCloud, read, write_las
from scenenet.pointcloud.targets import Target
from scenenet.training.presets import preset

POLE = 15


@pytest.fixture(scope="module")
def files(tmp_path_factory, scene, pole_finder):
    """A survey with two poles and a model that finds poles as a target of its own."""
    folder = tmp_path_factory.mktemp("targets")
    write_las(folder / "s.laz", scene([(15.5, 15.5), (45.5, 15.5)], size=(60.0, 30.0)))
    model, _ = pole_finder
    write_model(folder / "pole.json", model, model_card(name="poles", target="pole=15"))
    return folder


def test_a_model_of_a_target_is_trained_and_says_so(files, tmp_path, call):
    out = tmp_path / "m.json"
    printed = call(
        "train", files / "s.laz", "--codes", "edp", "--target", "15", "--out", out, "--protocol",
        "thesis", "--epochs", "1", "--seeds", "1", "--voxel-size", "0.8", "--square", "30",
        "--validation", "0", "--json",
    )  # fmt: skip
    printed = json.loads(printed.out)
    assert printed["target"] == "class_15"
    assert printed["crops"] == {"training": 2, "validation": 0}
    _, card = read_model(out)
    assert (card.target, card.fit, card.voxel_size) == ("class_15=15", "metric", 0.8)
    assert card.finds == Target("class_15", (15,))


def test_only_a_model_of_towers_gives_whole_towers():
    assert preset("scenenet", "operational").gives_whole_towers
    wire = preset("scenenet", "operational", target=Target.parse("wire"))
    assert not wire.gives_whole_towers
    with pytest.raises(ValidationError, match="finds no towers"):
        ModelSettings(name="m", kind="scenenet", protocol="operational", target="wire")


def test_vegetation_has_an_observer_of_its_own_whatever_its_codes():
    for text in ("vegetation", "vegetation=5,12"):
        chosen = preset("scenenet", "operational", target=Target.parse(text))
        assert chosen.geneos == ("blob", "plane") and not chosen.gives_whole_towers
    wish = {"geneos": ["line"], "target": Target("vegetation")}
    other = preset("scenenet", "operational", **wish)
    assert other.geneos == ("line",)


def test_settings_of_a_model_of_towers_are_those_of_earlier_versions():
    tower, wire = (ModelSettings(name="m", kind="cnn", target=name) for name in ("tower", "wire"))
    assert "target" not in tower.model_dump()
    assert wire.model_dump() == tower.model_dump() | {"target": "wire"}


def test_points_at_or_above_tau_are_scored_and_no_towers(files, call):
    called = call("evaluate", files / "s.laz", "--codes", "edp", "--model",
                     files / "pole.json", "--fit", "metric", "--json")  # fmt: skip
    scores = json.loads(called.out)
    cloud = read(files / "s.laz", "edp")
    model, card = read_model(files / "pole.json")
    grid = VoxelGrid.on_map(cloud.xyz, 1.0)
    probability, _ = probabilities(model, voxelise(cloud, grid), card.measurement)
    taken = probability[grid.voxel_of(cloud.xyz)] >= POLE_TAU
    labelled = cloud.classification == POLE
    both = int((taken & labelled).sum())
    assert both > 300  # the model finds its poles
    assert scores["points"] == {
        "precision": pytest.approx(both / taken.sum()),
        "recall": pytest.approx(both / labelled.sum()),
        "iou": pytest.approx(both / (taken | labelled).sum()),
        "n_true": int(labelled.sum()),
        "n_predicted": int(taken.sum()),
        "n_points": len(taken),
    }
    assert (scores["target"], scores["towers"], scores["voxel_towers"]) == ("pole=15", None, None)
    assert scores["voxel"] == scores["voxel_observer"]


def test_the_codes_of_a_target_may_differ_in_other_files(files, tmp_path, call):
    """A target with codes of its own is scored in another scheme by the codes given for that."""
    cloud = read(files / "s.laz", "edp")
    codes = np.where(cloud.classification == POLE, 19, cloud.classification).astype(np.uint8)
    write_las(tmp_path / "other.laz", PointCloud(cloud.xyz, codes))
    given = "evaluate", tmp_path / "other.laz", "--codes", "asprs", "--model", files / "pole.json"
    refused = call(*given)
    assert refused.code == 1
    assert "Give the codes in asprs: --target pole=CODES" in refused.err
    assert "it finds pole, not lamp" in call(*given, "--target", "lamp=19").err
    scores = json.loads(call(*given, "--target", "pole=19", "--json").out)
    assert scores["points"]["n_true"] == int((codes == 19).sum())
    assert scores["points"]["recall"] > 0.5


def test_a_file_without_the_target_is_an_error_that_names_its_codes(files, tmp_path, call):
    called = call("train", files / "s.laz", "--codes", "edp", "--target", "wire", "--out",
                  tmp_path / "m.json")  # fmt: skip
    reason = "no point is labelled wire (class codes 16, 17 in edp); the codes in it are 2, 4, 15"
    assert called.code == 1
    assert reason in called.err
    assert not (tmp_path / "m.json").exists()


def test_a_target_that_does_not_exist_is_a_usage_error(files, tmp_path, call):
    called = call("train", files / "s.laz", "--codes", "edp", "--target", "wires", "--out",
                  tmp_path / "m.json")  # fmt: skip
    assert called.code == 2
    assert "there is no target 'wires'" in called.err


def test_wires_are_classified_only_by_a_named_scheme(files, pole_finder, tmp_path, call):
    write_model(tmp_path / "wire.json", pole_finder[0], model_card(target="wire"))
    given = "predict", files / "s.laz", "--model", tmp_path / "wire.json", "--out", tmp_path / "o"
    refused = call(*given, "--classify")
    assert refused.code == 2
    assert "needs the class scheme of the survey" in refused.err
    called = call(*given, "--classify", "--codes", "asprs")
    assert called.code == 0
    assert "towers were not looked for" in called.out
    codes = np.asarray(laspy.read(tmp_path / "o" / "s.laz").classification)
    assert f"{(codes == 14).sum():,} wire points" in called.out


def test_only_towers_are_explained(files, tmp_path, call):
    refused = call("explain", files / "s.laz", "--model", files / "pole.json", "--out",
                   tmp_path / "e.html")  # fmt: skip
    assert refused.code == 1
    assert "it finds pole, and only towers are explained" in refused.err


def test_without_the_target_the_error_has_the_codes_of_the_file(files, tmp_path, call):
    survey, out = files / "s.laz", tmp_path / "m.json"
    done = call("train", survey, "--codes", "edp", "--target", "wire", "--out", out)
    assert done.code == 1 and not out.exists()
    text = " ".join(done.err.split())
    assert f"{survey}: no labelled wire in it" in text
    assert "in edp the points of wire have the code 16 or 17, and here are the codes 2 (" in text
