"""The certificate of a model with orbits and a first observer."""

from __future__ import annotations

import json

import pytest

from scenenet.interpretability.certificate import certificate
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.model_file import ModelCard, write_model
from scenenet.models.settings import MetricSettings
from scenenet.training.presets import OBSERVERS

NUMBERS = {
    "line.l": 5.0,
    "line.r": 0.3,
    "lambda.line": 1.0,
    "first.canopy.r": 1.5,
    "first.ground.r": 2.5,
    "first.ground.h": 0.6,
    "first.lambda.identity": 0.5,
    "first.lambda.canopy": 0.2,
    "first.lambda.ground": 0.3,
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    wire = OBSERVERS["wire"]
    model = MetricSceneNet.composed(wire["geneos"], wire["first"], MetricSettings(**wire["metric"]))
    model.set_shape_parameters(NUMBERS)
    path = tmp_path_factory.mktemp("wire") / "wire.json"
    card = ModelCard(
        name="wire", codes="edp", measurement="presence", fit="metric", resolution=64,
        voxel_size=0.5, tau=0.2, target="wire",
    )  # fmt: skip
    write_model(path, model, card)
    return certificate(path)


def statement(made, words: str):
    (found,) = [s for s in made.statements if words in s.property]
    return found


def test_what_a_composition_keeps_is_verified(made):
    assert statement(made, "translation").holds
    assert statement(made, "quarter turns").holds
    assert not statement(made, "any rotation").holds


@pytest.mark.parametrize(("name", "turns"), [("line", 32), ("first.ground", 16)])
def test_the_turns_of_an_orbit_are_permuted_to_rounding(made, name, turns):
    found = statement(made, f"{name}: its {turns} turns")
    assert found.holds
    (orbit,) = [o for o in made.numbers["orbits"] if o["name"] == name]
    assert orbit["own"] < 1e-6
    assert 0.01 < orbit["between"] < 0.6


def test_the_measured_constant_stays_below_its_bound(made):
    assert 0 < made.numbers["measured"] <= made.numbers["l1_bound"]
    first, own = made.numbers["stages"]
    assert made.numbers["l1_bound"] == pytest.approx(first["constant"] * own["constant"])


def test_each_observer_is_convex(made):
    assert statement(made, "first observer: convex").holds
    assert [s["name"] for s in made.numbers["stages"]] == ["first observer", "observer"]


def test_it_is_written_as_plain_values(made):
    again = type(made).from_json(json.loads(json.dumps(made.to_json())))
    assert again.statements == made.statements
