"""The certificate of a model file has its properties in words and numbers."""

from __future__ import annotations

import json

import pytest
from fixtures.scenes import model_card

from scenenet.interpretability.certificate import certificate
from scenenet.interpretability.geneo_properties import certify
from scenenet.interpretability.result import ModelCertificate
from scenenet.models.cnn import CNN
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.model_file import ModelCard, write_model
from scenenet.models.settings import MetricSettings


@pytest.fixture(scope="module")
def card() -> ModelCard:
    return model_card(provenance={"seed": 4})


@pytest.fixture(scope="module")
def field(card, tmp_path_factory):
    path = tmp_path_factory.mktemp("models") / "m.json"
    write_model(path, MetricSceneNet(metric=MetricSettings()), card)
    return certificate(path)


def test_the_certificate_is_measured_at_the_voxel_size_of_the_model(field, card, tmp_path):
    from scenenet.models.model_file import read_model

    path = tmp_path / "m.json"
    small = card.model_copy(update={"voxel_size": 1.5})
    write_model(path, MetricSceneNet(metric=MetricSettings()), small)
    model, _ = read_model(path)
    found = certificate(path)
    assert found.numbers["l1"] == certify(model, voxel_size=1.5, tau=0.7).l1
    assert (found.model, found.seed, found.voxel_size) == ("m", 4, 1.5)


def test_each_statement_has_its_number(field):
    values = {s.property: s.value for s in field.statements}
    numbers = field.numbers
    assert len(values) == 8
    assert values["equivariant under translation by whole voxels"] == numbers["translation_error"]
    assert values["equivariant under quarter turns about z"] == numbers["quarter_turn_error"]
    assert values["the observer H is non-expansive without scaling"] == numbers["l1"]
    assert values["convex combination of GENEOs"] == numbers["weight_sum"]
    turned = [turn.mean_h for turn in field.turns if turn.degrees % 90]
    assert values["equivariant under any rotation about z"] == max(turned)
    assert values["zero-sum kernels sum to zero"] < 1e-4


def test_a_cnn_only_has_the_statements_of_a_convolution(card, tmp_path):
    path = tmp_path / "m.safetensors"
    write_model(path, CNN(kernel_size=(5, 5, 5)), card)
    verified = {s.property: s.holds for s in certificate(path).statements}
    assert verified == {
        "equivariant under translation by whole voxels": True,
        "equivariant under quarter turns about z": False,
    }


def test_it_is_reproducible_and_has_plain_values(field, card, tmp_path):
    read = ModelCertificate.from_json(json.loads(json.dumps(field.to_json(), allow_nan=False)))
    assert read.statements == field.statements and read.turns == field.turns
    assert read.half_voxel == field.half_voxel
    assert read.numbers["kernels"][0]["name"] == "cylinder"
    assert set(read.numbers) == set(field.numbers)
    assert read.statements[0].holds is True


def test_a_certificate_with_a_missing_number_is_refused(field):
    record = field.to_json()
    del record["half_voxel"]["mean_h"]
    with pytest.raises(TypeError, match="mean_h"):
        ModelCertificate.from_json(record)
