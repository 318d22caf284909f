"""The certificate of a model file says in words and numbers what the model keeps."""

from __future__ import annotations

import json

import pytest

from scenenet.interpretability.certificate import certificate
from scenenet.interpretability.geneo_properties import certify
from scenenet.models.cnn import CNN
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.model_file import ModelCard, write_model
from scenenet.models.settings import MetricSettings


@pytest.fixture(scope="module")
def card() -> ModelCard:
    return ModelCard(
        name="m",
        codes="edp",
        measurement="presence",
        fit="metric",
        resolution=64,
        voxel_size=1.0,
        tau=0.7,
        provenance={"seed": 4},
    )


@pytest.fixture(scope="module")
def field(card, tmp_path_factory):
    path = tmp_path_factory.mktemp("models") / "m.json"
    write_model(path, MetricSceneNet(metric=MetricSettings()), card)
    return certificate(path)


def test_it_is_that_of_the_model_at_the_voxel_size_of_its_card(field, card, tmp_path):
    from scenenet.models.model_file import read_model

    path = tmp_path / "m.json"
    small = card.model_copy(update={"voxel_size": 1.5})
    write_model(path, MetricSceneNet(metric=MetricSettings()), small)
    model, _ = read_model(path)
    found = certificate(path)
    assert found["l1"] == certify(model, voxel_size=1.5, tau=0.7).l1
    assert (found["model"], found["seed"], found["voxel_size"]) == ("m", 4, 1.5)


def test_each_statement_has_the_number_that_goes_with_it(field):
    values = {s["property"]: s["value"] for s in field["statements"]}
    assert len(values) == 8
    assert values["equivariant under translation by whole voxels"] == field["translation_error"]
    assert values["equivariant under quarter turns about z"] == field["quarter_turn_error"]
    assert values["the observer H is non-expansive as it stands"] == field["l1"]
    assert values["convex combination of GENEOs"] == field["weight_sum"]
    turned = [t["mean_h"] for t in field["turns"] if t["degrees"] % 90]
    assert values["equivariant under any rotation about z"] == max(turned)
    assert values["zero-sum kernels sum to zero"] < 1e-4


def test_of_a_cnn_only_what_a_convolution_has_is_said(card, tmp_path):
    path = tmp_path / "m.safetensors"
    write_model(path, CNN(kernel_size=(5, 5, 5)), card)
    told = {s["property"]: s["holds"] for s in certificate(path)["statements"]}
    assert told == {
        "equivariant under translation by whole voxels": True,
        "equivariant under quarter turns about z": False,
    }


def test_it_is_plain_and_the_same_each_time(field, card, tmp_path):
    assert json.loads(json.dumps(field))["statements"][0]["holds"] is True
