"""Model files are read back as written, readable, and refused if invalid."""

from __future__ import annotations

import json

import pytest
import torch

from scenenet.core.errors import InputError
from scenenet.models.cnn import CNN
from scenenet.models.model_file import ModelCard, read_model, suffix, write_model
from scenenet.models.scenenet import SceneNet

CARD = ModelCard(
    name="m",
    codes="edp",
    measurement="presence",
    fit="cube",
    resolution=64,
    voxel_size=0.9,
    tau=0.25,
    provenance={"seed": 3, "config": "abc"},
)


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
        (_put([9, 9], "kernel_size"), "not a readable model file"),
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


def test_weights_without_a_card_are_refused(tmp_path):
    from safetensors.torch import save_file

    save_file({"bias": torch.zeros(3)}, tmp_path / "m.safetensors")
    with pytest.raises(InputError, match="not a readable model file"):
        read_model(tmp_path / "m.safetensors")


def test_a_missing_model_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such model file"):
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
