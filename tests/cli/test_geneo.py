"""``scenenet geneo``: the workbench for kernels."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from fixtures.scenes import make_pole_finder

from scenenet.core.provided_code import KERNELS
from scenenet.models.model_file import write_model
from scenenet.models.scenenet import SceneNet

pytestmark = pytest.mark.usefixtures("nothing_provided")


def test_the_list_has_every_kernel_with_its_parameters_and_its_origin(call, tmp_path):
    assert call("geneo", "new", "lamp", "--out", tmp_path).code == 0
    shown = call("geneo", "list", "--kernels", tmp_path, "--json")
    kernels = {kernel["name"]: kernel for kernel in json.loads(shown.out)}
    assert {"cylinder", "arrow", "negative_sphere", "lamp"} <= kernels.keys()
    assert kernels["cylinder"]["origin"] == "built in"
    assert kernels["cylinder"]["responds_to"].startswith("The body of a tower")
    assert kernels["lamp"]["origin"] == str(tmp_path / "lamp.py")
    assert kernels["lamp"]["parameters"][0] | {"value": 0, "sentence": ""} == {
        "name": "r", "unit": "m", "low": 0.1, "high": 1.5, "meaning": "radius of the column",
        "value": 0, "sentence": "",
    }  # fmt: skip
    assert (
        "    r        0.1 to 1.5 m: radius of the column"
        in call("geneo", "list", "--kernels", tmp_path).out
    )


def test_a_kernel_that_fails_stops_no_other(call, tmp_path):
    (tmp_path / "broken.py").write_text("import nothing_like_this\n")
    shown = call("geneo", "list", "--kernels", tmp_path)
    assert shown.code == 1
    assert "cylinder (built in)" in shown.out
    assert (
        f"error: {tmp_path / 'broken.py'}: line 1: the kernel file fails with Module" in shown.err
    )


def test_the_template_passes_its_test_as_it_is_written(call, tmp_path):
    shown = call("geneo", "new", "thin_post", "--out", tmp_path / "mine")
    assert shown.code == 0
    test = tmp_path / "mine" / "test_thin_post.py"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", test.name],
        cwd=test.parent, capture_output=True, text=True,
    )  # fmt: skip
    assert "4 passed" in done.stdout, done.stdout + done.stderr


def test_a_template_replaces_nothing_that_was_changed(call, tmp_path):
    new = ("geneo", "new", "lamp", "--out", tmp_path)
    assert call(*new).code == 0
    assert call(*new).code == 0  # unchanged, so it may be written again
    kernel, test = tmp_path / "lamp.py", tmp_path / "test_lamp.py"
    test.write_text("assert True\n")
    kernel.unlink()
    refused = call(*new)
    assert refused.code == 1
    assert "test_lamp.py: this file exists, and is not an unchanged result" in refused.err
    assert test.read_text() == "assert True\n"
    assert not kernel.exists()
    assert call(*new, "--overwrite").code == 0
    assert "def test_" in test.read_text()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("cylinder", "there is a kernel called 'cylinder' already"),
        ("Lamp", "must have small letters"),
        ("lamp_2", "must not end in a number"),
        ("test_lamp", "must not begin like the name of a test"),
    ],
)
def test_a_name_that_no_kernel_can_have_is_refused(call, tmp_path, name, message):
    shown = call("geneo", "new", name, "--out", tmp_path)
    assert shown.code == 1
    assert message in shown.err
    assert not list(tmp_path.iterdir())


def test_a_kernel_is_shown_with_its_values_in_words_and_in_numbers(call, tmp_path):
    picture = tmp_path / "cylinder.png"
    show = ("geneo", "show", "cylinder", "--set", "r=1.5", "--set", "sigma=0.5")
    shown = call(*show, "--out", picture).out
    assert "g(x) = exp(" in shown
    assert "r = 1.5 m, of 0.05 to 4: radius of the tower's body" in shown
    assert "    a column 3.0 m wide gives the strongest response" in shown
    assert "every slice sums to zero: yes" in shown
    assert "quarter turns about z leave it unchanged: yes" in shown
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert call(*show, "--out", picture).code == 1
    assert "9 is the largest value and . is 0" in shown.splitlines()[-1]
    row = shown.partition("from above")[2].splitlines()[5]
    assert row.split() == row.split()[::-1]  # as from the other side

    values = json.loads(call(*show, "--json").out)
    assert len(values["values"]) == values["facts"]["size"][0] == 13
    assert abs(sum(map(sum, values["values"][0]))) < 1e-5


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("show", "cylnder"), 1, "unknown GENEO kernel 'cylnder'; did you mean 'cylinder'?"),
        (("show", "cylinder", "--set", "q=1"), 1, "has no parameter 'q'. Name one of: r, sigma"),
        (("show", "cylinder", "--set", "r=9"), 1, "cylinder.r = 9 m does not lie within 0.05 to 4"),
        (("show", "cylinder", "--set", "r"), 2, "'r' is not NAME=VALUE, such as r=0.5"),
        (("show", "cylinder", "--voxel-size", "0.05"), 1, "at most 64 voxels along an edge"),
        (("show", "cylinder", "--out", "a.pdf"), 2, "a picture is a .png file"),
        (("list", "--kernels", "none.py"), 1, "none.py: there is no such kernel file"),
    ],
)
def test_what_cannot_be_shown_is_said(call, arguments, code, message):
    shown = call("geneo", *arguments)
    assert shown.code == code
    assert message in " ".join(shown.err.replace("│", " ").split())
    assert "Traceback" not in shown.err


def test_a_trial_says_what_a_kernel_responds_to_by_class_and_where(call, pole_survey):
    trial = ("geneo", "try", "cylinder", pole_survey, "--codes", "edp", "--set", "r=0.3")
    found = json.loads(call(*trial, "--json").out)
    classes = {entry["code"]: entry for entry in found["classes"]}
    assert found["classes"][0]["code"] == 15
    assert classes[15]["name"] == "Power line support tower"
    assert classes[15]["positive"] == 1.0
    assert abs(classes[2]["mean"]) < 0.1 * classes[15]["mean"]
    assert sum(entry["points"] for entry in classes.values()) == found["points"]
    best = found["places"][0]
    assert (best["x"], best["y"]) == pytest.approx((500_025.5, 4_630_025.5), abs=1e-3, rel=0)
    assert best["code"] == 15
    assert best["response"] == classes[15]["highest"]
    apart = [
        (a["x"] - b["x"]) ** 2 + (a["y"] - b["y"]) ** 2 > 25
        for a in found["places"] for b in found["places"] if a is not b
    ]  # fmt: skip
    assert all(apart)
    error = found["equivariance"]
    assert error["translation"] < 1e-5 and error["quarter_turn"] < 1e-5
    assert 0 < error["between"] < 1
    assert "xyz" not in found


def test_a_square_of_a_survey_is_tried(call, pole_survey, monkeypatch):
    trial = ("geneo", "try", "cylinder", pole_survey)
    whole = json.loads(call(*trial, "--json").out)
    assert whole["window"] is None
    shown = call(*trial, "--at", "500025.5,4630025.5", "--window", "20")
    assert "only the square of 20 m about (500025.50, 4630025.50)" in shown.out
    part = json.loads(call(*trial, "--at", "500025.5,4630025.5", "--window", "20", "--json").out)
    assert 0.1 < part["points"] / whole["points"] < 0.5  # 20 x 20 of 50 x 50 m
    assert part["places"][0]["x"] == whole["places"][0]["x"]
    empty = call(*trial, "--at", "0,0")
    assert empty.code == 1
    assert "there is no point within 100 m of (0.00, 0.00)" in empty.err and "--at" in empty.err

    monkeypatch.setattr("scenenet.interpretability.workbench.trial.WHOLE", 100)
    large = json.loads(call(*trial, "--window", "5", "--json").out)
    assert large["window"]["edge"] == 5
    assert 0 < large["points"] < whole["points"] / 4


def test_the_page_of_a_trial_replaces_only_a_page_of_a_trial(call, pole_survey, tmp_path):
    page = tmp_path / "trial.html"
    trial = ("geneo", "try", "cylinder", pole_survey, "--out", page)
    assert call(*trial).code == 0
    assert call(*trial).code == 0
    text = page.read_text()
    assert "What the kernel cylinder responds to" in text
    assert text.count("data:image/png") >= 2
    page.write_text("mine")
    assert call(*trial).code == 1
    assert page.read_text() == "mine"


def test_a_model_is_certified(call, pole_model):
    shown = call("geneo", "certify", "--model", pole_model)
    assert shown.code == 0
    assert "yes  equivariant under translation" in shown.out
    found = json.loads(call("geneo", "certify", "--model", pole_model, "--json").out)
    assert found["kind"] == "scenenet"
    assert {"property", "thesis", "holds", "text", "value"} <= found["statements"][0].keys()


def test_a_model_with_a_direction_is_certified_by_what_holds_for_it(call, tmp_path):
    from fixtures.scenes import model_card

    from scenenet.models.metric_scenenet import MetricSceneNet
    from scenenet.models.model_file import write_model

    path = tmp_path / "wires.json"
    write_model(path, MetricSceneNet(["line"]), model_card())
    shown = call("geneo", "certify", "--model", path)
    assert shown.code == 0
    assert "line: its 32 turns are permuted by a turn of the scene" in shown.out


def test_a_tower_is_explained_with_a_kernel_outside_the_package(call, pole_survey, tmp_path):
    call("geneo", "new", "ring", "--out", tmp_path)
    KERNELS.provide([tmp_path / "ring.py"])
    pole, card = make_pole_finder()
    model = SceneNet([*pole.geneos, "ring"], pole.kernel_size)
    numbers = model.shape_parameters() | pole.shape_parameters()
    given = numbers["lambda.cylinder"] - 0.01
    model.set_shape_parameters(numbers | {"lambda.cylinder": given, "lambda.ring": 0.01})
    write_model(tmp_path / "m.json", model, card)
    page = tmp_path / "why.html"
    explained = call(
        "explain", pole_survey, "--model", tmp_path / "m.json", "--kernels", tmp_path / "ring.py",
        "--min-conductor", "0", "--out", page,
    )  # fmt: skip
    assert explained.code == 0, explained.err
    assert ">ring</td>" in page.read_text()
