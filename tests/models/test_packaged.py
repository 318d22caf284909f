"""The models that come with the package."""

from __future__ import annotations

import json

import pytest

from scenenet.core.files import sha256
from scenenet.models.model_file import read_model
from scenenet.models.packaged import PACKAGED, TOWERS, WIRES, packaged_card, packaged_model


@pytest.mark.parametrize(
    ("name", "target", "parameters"), [(TOWERS, "tower", 11), (WIRES, "wire", 7)]
)
def test_it_is_a_tuned_model_in_metres(name, target, parameters):
    model, card = read_model(packaged_model(name))
    assert (card.target, model.n_parameters(), model.units) == (target, parameters, "m")
    assert 0 < card.threshold() < 1


@pytest.mark.parametrize("name", PACKAGED)
def test_it_is_the_file_that_its_card_describes(name):
    text = packaged_card(name).read_text(encoding="utf-8")
    assert sha256(packaged_model(name)) in text
    numbers = json.loads(packaged_model(name).read_text(encoding="utf-8"))
    parts = [("", numbers), *([("first.", numbers["first"])] if "first" in numbers else [])]
    for start, part in parts:
        for geneo in part["geneos"]:
            for parameter, known in geneo["parameters"].items():
                row = f"| `{start}{geneo['name']}.{parameter}` | {known['value']:.3g} |"
                assert row in text
        for kernel, weight in part["mixing_weights"].items():
            assert f"| `{start}lambda.{kernel}` | {weight:.3g} |" in text


@pytest.mark.parametrize("name", PACKAGED)
def test_it_is_small(name):
    assert packaged_model(name).stat().st_size < 10_000
