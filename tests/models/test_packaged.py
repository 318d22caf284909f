"""The model that comes with the package."""

from __future__ import annotations

import json

from scenenet.core.files import sha256
from scenenet.models.model_file import read_model
from scenenet.models.packaged import packaged_card, packaged_model


def test_it_is_a_tuned_model_of_eleven_parameters_in_metres():
    model, card = read_model(packaged_model())
    assert (model.n_parameters(), model.units) == (11, "m")
    assert 0 < card.threshold() < 1


def test_it_is_the_file_that_its_card_describes():
    text = packaged_card().read_text(encoding="utf-8")
    assert sha256(packaged_model()) in text
    numbers = json.loads(packaged_model().read_text(encoding="utf-8"))
    for geneo in numbers["geneos"]:
        for name, known in geneo["parameters"].items():
            assert f"| `{geneo['name']}.{name}` | {known['value']:.3g} |" in text


def test_it_is_small():
    assert packaged_model().stat().st_size < 10_000
