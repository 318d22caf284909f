"""Model files are read back as written, readable, and refused if invalid."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
import torch
from fixtures.scenes import model_card
from safetensors import safe_open

from scenenet.core.errors import InputError
from scenenet.models.cnn import CNN
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.model_file import read_model, suffix, write_model
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import LARGEST_KERNEL, MetricSettings
from scenenet.prediction.work.lattice import EDGE

CARD = model_card(fit="cube", voxel_size=0.9, tau=0.25, provenance={"seed": 3, "config": "abc"})


@pytest.fixture
def written(tmp_path):
    """A SCENE-Net and the file it was written to."""
    model = SceneNet(kernel_size=(9, 5, 5), generator=torch.Generator().manual_seed(3))
    write_model(tmp_path / "m.json", model, CARD)
    return model, tmp_path / "m.json"


@pytest.mark.parametrize(
    "model",
    [
        SceneNet(kernel_size=(9, 5, 7)),
        SceneNet(["arrow", "arrow", "negative_sphere"]),
        SceneNet(["cylinder"]),
        CNN(2, (3, 5, 4)),
        CNN(),
    ],
    ids=["scenenet", "repeated kernel", "one kernel", "cnn", "cnn of the thesis"],
)
def test_a_model_is_read_back_as_it_was_written(tmp_path, model):
    path = tmp_path / f"m{suffix(model.kind)}"
    write_model(path, model, CARD)
    back, card = read_model(path)
    assert card == CARD
    assert back.kind == model.kind
    assert back.kernel_size == model.kernel_size
    for (name, a), (_, b) in zip(
        back.state_dict().items(), model.state_dict().items(), strict=True
    ):
        assert torch.equal(a, b), name  # to the last bit
    assert torch.equal(back.observer()[0], model.observer()[0])


def test_a_model_file_names_its_target_unless_it_is_the_tower(tmp_path):
    model = SceneNet(["cylinder"])
    texts = {}
    for target in ("tower", "wire", "lamp=14,16"):
        path = tmp_path / f"{target}.json"
        write_model(path, model, CARD.model_copy(update={"target": target}))
        texts[target] = json.loads(path.read_text())
        assert read_model(path)[1].target == target
    assert "target" not in texts["tower"]  # as in files of earlier versions
    assert texts["wire"] == texts["tower"] | {"target": "wire"}


def test_a_model_file_with_an_unknown_target_is_refused(tmp_path):
    path = tmp_path / "m.json"
    write_model(path, SceneNet(["cylinder"]), CARD)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"target": "wires"}))
    with pytest.raises(InputError, match="there is no target 'wires'"):
        read_model(path)


def test_the_file_of_a_scene_net_is_readable(written):
    model, path = written
    data = json.loads(path.read_text())
    assert data["format"] == "scenenet-model"
    assert data["kind"] == "scenenet"
    assert data["kernel_size"] == [9, 5, 5]
    assert data["units"] == "voxel"
    assert data["tau"] == 0.25
    cylinder = data["geneos"][0]
    assert cylinder["kernel"] == "cylinder"
    assert cylinder["parameters"]["r"] == {
        "value": model.shape_parameters()["cylinder.r"],
        "unit": "voxel",
        "meaning": "radius of the tower's body",
    }
    assert sum(data["mixing_weights"].values()) == pytest.approx(1)


def test_a_number_edited_by_hand_is_read(written):
    _, path = written
    data = json.loads(path.read_text())
    data["geneos"][0]["parameters"]["r"]["value"] = 1.25
    path.write_text(json.dumps(data))
    assert read_model(path)[0].shape_parameters()["cylinder.r"] == 1.25


NAN, INF = float("nan"), float("inf")


def _drop(*keys):
    def change(data):
        for key in keys[:-1]:
            data = data[key]
        del data[keys[-1]]

    return change


def _put(value, *keys):
    def change(data):
        for key in keys[:-1]:
            data = data[key]
        data[keys[-1]] = value

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_put("other", "format"), "not a model file of scenenet"),
        (_put(99, "format_version"), "model format 99; this version reads formats 1"),
        (_drop("kernel_size"), "not a readable model file .KeyError"),
        (_drop("voxel_size"), "not a readable model file"),
        (_put(-1.0, "voxel_size"), "not a readable model file"),
        (_put(1.5, "tau"), "not a readable model file"),
        (
            _put(10**39, "geneos", 0, "parameters", "r", "value"),
            "not a readable model file|not a finite number",
        ),
        (
            _put(10**400, "geneos", 0, "parameters", "r", "value"),
            "not a readable model file .OverflowError",
        ),
        (
            _put([9, 9], "kernel_size"),
            "not a readable model file .kernel_size is .9, 9., not three",
        ),
        (_put([65, 9, 9], "kernel_size"), "kernel_size is .65, 9, 9., not three .* from 1 to 64"),
        (_put([0, 9, 9], "kernel_size"), "kernel_size is .0, 9, 9., not three"),
        (_put([9.7, 9, 9], "kernel_size"), "kernel_size is .9.7, 9, 9., not three"),
        (_put(1e300, "voxel_size"), "not a readable model file .voxel_size = 1e.300: "),
        (_put(1e-300, "voxel_size"), "not a readable model file .voxel_size = 1e-300: "),
        (_put(NAN, "voxel_size"), "not a readable model file .voxel_size = nan: "),
        (_put(NAN, "mixing_weights", "arrow"), "lambda.arrow is nan, not a finite number"),
        (_put(INF, "geneos", 0, "parameters", "r", "value"), "cylinder.r is inf, not a finite"),
        (_put(1e39, "geneos", 1, "parameters", "beta", "value"), "arrow.beta is 1e.39, not a fin"),
        (_put([], "geneos"), "at least one GENEO"),
        (_put(["cylinder"], "geneos"), "not a readable model file"),
        (_put("disk", "geneos", 0, "kernel"), "unknown GENEO kernel 'disk'"),
        (_drop("geneos", 0, "parameters", "r"), "parameters are missing: cylinder.r"),
        (_put([1, 2], "geneos", 0, "parameters"), "not a readable model file"),
        (_put({"cylinder": 1.0}, "mixing_weights"), "parameters are missing: lambda.arrow"),
        (_put(7.0, "mixing_weights", "arrow"), "mixing weights sum to"),
        (_put("wide", "geneos", 0, "parameters", "r", "value"), "not a readable model file"),
    ],
)
def test_an_incomplete_model_file_is_refused_by_name(written, change, message):
    _, path = written
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match=message) as refused:
        read_model(path)
    assert refused.value.file == str(path)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("m.json", b"{ half"),
        ("m.json", b"\xff\xfe\x00"),
        ("m.json", b"[1, 2]"),
        ("m.safetensors", b""),
        ("m.safetensors", b"\x80\x04\x95pickled"),
    ],
)
def test_another_kind_of_file_is_refused_by_name(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=r"not a (readable )?model file") as refused:
        read_model(tmp_path / name)
    assert refused.value.file == str(tmp_path / name)


def test_a_survey_in_place_of_a_model_is_named(tmp_path):
    path = tmp_path / "line.laz"
    path.write_bytes(b"LASF\x00\xff")
    with pytest.raises(InputError, match="this is a LAS or LAZ file, not a model"):
        read_model(path)


def test_weights_without_a_card_are_refused(tmp_path):
    from safetensors.torch import save_file

    save_file({"bias": torch.zeros(3)}, tmp_path / "m.safetensors")
    with pytest.raises(InputError, match="not a readable model file"):
        read_model(tmp_path / "m.safetensors")


def _write_weights(path: Path, tensors: dict[str, torch.Tensor], **head) -> None:
    """A CNN file with any weights and any head."""
    from safetensors.torch import save_file

    write_model(path, CNN(), CARD)
    with safe_open(path, framework="pt") as stream:
        known = json.loads(stream.metadata()["model"])
    save_file(tensors, path, metadata={"model": json.dumps(known | head)})


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("weight", NAN, r"weight\[1, 2, 3, 4\] is nan, not a finite number"),
        ("weight", -INF, r"weight\[1, 2, 3, 4\] is -inf, not a finite number"),
        ("bias", INF, r"bias\[2\] is inf, not a finite number"),
    ],
)
def test_weights_that_are_not_finite_are_neither_read_nor_written(tmp_path, name, value, message):
    model = CNN()
    place = (1, 2, 3, 4) if name == "weight" else (2,)
    model.state_dict()[name][place] = value
    path = tmp_path / "m.safetensors"
    with pytest.raises(InputError, match=message) as refused:
        write_model(path, model, CARD)
    assert refused.value.file == str(path)
    assert not path.exists()
    _write_weights(path, model.state_dict())
    with pytest.raises(InputError, match=message) as refused:
        read_model(path)
    assert refused.value.file == str(path)


@pytest.mark.parametrize("kind", [SceneNet, MetricSceneNet])
@pytest.mark.parametrize("name", ["lambda.arrow", "negative_sphere.omega"])
def test_numbers_that_are_not_finite_are_not_written(tmp_path, kind, name):
    model = kind()
    group, symbol = name.split(".")
    stored = model.mixing if group == "lambda" else model.shapes[group]
    stored[symbol].data.fill_(NAN)
    # A softmax of one NaN is NaN everywhere, so the first weight may be named instead.
    named = r"lambda\.\w+" if group == "lambda" else name
    with pytest.raises(InputError, match=f"{named} is nan, not a finite number"):
        write_model(tmp_path / "m.json", model, CARD)
    assert not (tmp_path / "m.json").exists()


@pytest.mark.parametrize(
    ("tensors", "head", "message"),
    [
        (CNN().state_dict(), {"kernel_size": [500, 500, 800]}, "kernel_size is .500, 500, 800."),
        (CNN().state_dict(), {"kernel_size": [64, 64, 64]}, "weights of the shapes"),
        ({"weight": torch.zeros(1, 9, 9, 9)}, {}, "weights of the shapes"),
        ({"weight": torch.zeros(0, 9, 9, 9), "bias": torch.zeros(0)}, {}, "weights of the shapes"),
        (
            {"weight": torch.zeros(1, 9, 9, 9, dtype=torch.int32), "bias": torch.zeros(1)},
            {},
            "weight has the type torch.int32",
        ),
    ],
    ids=["claimed size", "largest size", "no bias", "no kernel", "whole numbers"],
)
def test_weights_that_do_not_fit_the_head_are_refused(tmp_path, tensors, head, message):
    _write_weights(tmp_path / "m.safetensors", tensors, **head)
    with pytest.raises(InputError, match=message) as refused:
        read_model(tmp_path / "m.safetensors")
    assert refused.value.file == str(tmp_path / "m.safetensors")


def test_a_claimed_kernel_takes_no_memory(tmp_path):
    """64^3 is allowed, and 4000 kernels of it take 4.2 GB; the file has 9 kB."""
    path = tmp_path / "m.safetensors"
    tensors = {"weight": torch.zeros(1, 9, 9, 9), "bias": torch.zeros(4000)}
    _write_weights(path, tensors, kernel_size=[64, 64, 64])
    code = (
        "import resource, sys\n"
        "from scenenet.core.errors import InputError\n"
        "from scenenet.models.model_file import read_model\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "try:\n"
        "    read_model(sys.argv[1])\n"
        "except InputError:\n"
        "    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True
    )
    assert int(done.stdout) < 100_000  # KiB


def test_lengths_and_voxels_stay_within_what_a_tile_holds():
    """A SCENE-Net in metres observes voxels of at least 2/3 m."""
    longest = MetricSettings(
        radius=20.0, above=20.0, below=20.0, section_radius=20.0, section_above=20.0
    )
    model = MetricSceneNet(metric=longest)
    sizes = [model.observed_size(0.01 * n) for n in range(1, 400)]
    assert min(sizes) >= 2 / 3
    observed = [model.at(size) for size in sizes]
    assert max(max(m.kernel_size) for m in observed) <= LARGEST_KERNEL
    assert max(max(m.reach) for m in observed) <= EDGE


def test_a_missing_model_file_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"no such model file.*towers or wires"):
        read_model(tmp_path / "m.json")


def test_each_kind_has_its_suffix(tmp_path):
    assert (suffix("scenenet"), suffix("cnn")) == (".json", ".safetensors")
    with pytest.raises(ValueError, match="must end in"):
        write_model(tmp_path / "m.json", CNN(), CARD)
    assert not (tmp_path / "m.json").exists()


def test_an_untuned_model_has_no_threshold():
    untuned = CARD.model_copy(update={"tau": None})
    with pytest.raises(InputError, match=r"'m' has no detection threshold.*Tune it"):
        untuned.threshold()
    assert untuned.with_tau(0.5).threshold() == 0.5
