"""Models whose measurement is the answer of a first observer, and whose kernels have directions."""

from __future__ import annotations

import json

import numpy as np
import pytest
import torch

from scenenet.convolution.occupancy import Occupancy
from scenenet.core.errors import InputError
from scenenet.models.known_answers import KnownAnswers
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.model_file import ModelCard, read_model, write_model
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import MetricSettings, ModelSettings

WIRE = MetricSettings(
    numbers="searched", whole_towers=False, section_radius=0, section_above=0, observed=0.5
)
NUMBERS = {
    "line.l": 8.0,
    "line.r": 0.4,
    "lambda.line": 1.0,
    "first.canopy.r": 3.0,
    "first.ground.r": 3.0,
    "first.ground.h": 1.0,
    "first.lambda.identity": 0.45,
    "first.lambda.canopy": 0.2,
    "first.lambda.ground": 0.35,
}


def wire_model() -> MetricSceneNet:
    model = MetricSceneNet.composed(("line",), ("identity", "canopy", "ground"), WIRE)
    model.set_shape_parameters(NUMBERS)
    return model.at(0.5)


def scene() -> tuple[Occupancy, np.ndarray]:
    """A wire 10 m above even ground, beside a crown; and which occupied voxels are the wire."""
    rng = np.random.default_rng(0)
    shape = (32, 60, 60)
    ground = rng.random((60, 60)) < 0.7
    volume = np.zeros(shape, bool)
    volume[1][ground] = True
    crown = rng.random((12, 12, 12)) < 0.4
    volume[8:20, 5:17, 5:17] = crown
    volume[22, 40, :] = True
    occupancy = Occupancy.of_grids([np.flatnonzero(volume)], None, shape)
    z, _, _ = np.unravel_index(occupancy.index, shape)
    return occupancy, z == 22


def test_it_finds_a_wire_and_not_ground_or_crown():
    occupancy, wire = scene()
    with torch.no_grad():
        probability = wire_model()(occupancy).numpy().reshape(-1)[occupancy.flat()]
    assert probability[wire].min() > 2 * probability[~wire].max()


def test_the_parts_at_the_voxels_sum_to_the_observer():
    occupancy, _ = scene()
    model = wire_model()
    with torch.no_grad():
        parts = model.responder()(occupancy)
        whole = model(occupancy).reshape(-1)[torch.from_numpy(occupancy.flat())]
    torch.testing.assert_close(torch.relu(torch.tanh(parts.sum(dim=0))), whole)


def test_rows_have_the_answers_of_the_whole():
    occupancy, _ = scene()
    first = wire_model().first
    assert first is not None
    rows = np.flatnonzero(np.random.default_rng(1).random(len(occupancy.index)) < 0.3)
    with torch.no_grad():
        whole = first.responder()(occupancy)[:, torch.from_numpy(rows)]
        torch.testing.assert_close(first.row_responder()(occupancy, rows), whole, rtol=0, atol=0)
        # The ground lowers every sum, so it need not be asked where the crown has decided.
        spared = first.row_responder(above_zero=True)(occupancy, rows)
    lowered = whole.sum(dim=0) > 0
    assert 0 < lowered.sum() < len(rows)
    torch.testing.assert_close(spared[:, lowered], whole[:, lowered], rtol=0, atol=0)
    assert spared[:, ~lowered].sum(dim=0).max() <= 0
    assert (spared[2] == 0).sum() > (whole[2] == 0).sum()


def test_a_quarter_turn_of_the_scene_turns_the_answer():
    occupancy, _ = scene()
    dense = occupancy.dense()[0]
    model = wire_model()
    with torch.no_grad():
        before = model(occupancy)[0]
        turned = torch.rot90(dense, 1, (1, 2)).reshape(-1).numpy()
        after = model(Occupancy.of_grids([np.flatnonzero(turned)], None, tuple(dense.shape)))[0]
    torch.testing.assert_close(after, torch.rot90(before, 1, (1, 2)), rtol=0, atol=1e-6)


def test_the_reach_is_that_of_both_observers():
    model = wire_model()
    kz, _, kx = model.kernel_size
    assert model.first is not None
    fz, _, fx = model.first.kernel_size
    assert model.reach == (kz // 2 + fz // 2, kx // 2 + fx // 2, kx // 2 + fx // 2)
    # What lies further away has no influence.
    occupancy, wire = scene()
    seen = occupancy.dense()[0].numpy().astype(bool)
    at = np.array(np.unravel_index(occupancy.index[wire][10], occupancy.shape))
    near = np.zeros_like(seen)
    window = tuple(slice(max(0, c - r), c + r + 1) for c, r in zip(at, model.reach, strict=True))
    near[window] = seen[window]
    cut = Occupancy.of_grids([np.flatnonzero(near)], None, occupancy.shape)
    with torch.no_grad():
        assert model(cut)[0][tuple(at)] == model(occupancy)[0][tuple(at)]


def test_a_file_of_it_reads_back(tmp_path):
    model = wire_model()
    card = ModelCard(
        name="wire", codes="edp", measurement="presence", fit="metric", resolution=64,
        voxel_size=0.5, tau=0.2,
    )  # fmt: skip
    write_model(tmp_path / "wire.json", model, card)
    again, _ = read_model(tmp_path / "wire.json")
    assert again.shape_parameters() == pytest.approx(model.shape_parameters(), rel=1e-5)
    occupancy, _ = scene()
    with torch.no_grad():
        torch.testing.assert_close(again(occupancy), model(occupancy))
    written = json.loads((tmp_path / "wire.json").read_text())
    assert written["format_version"] == 5
    assert [entry["name"] for entry in written["first"]["geneos"]] == [
        "identity", "canopy", "ground",
    ]  # fmt: skip
    written["first"]["mixing_weights"]["canopy"] = 0.5
    (tmp_path / "wrong.json").write_text(json.dumps(written))
    with pytest.raises(InputError, match=r"mixing weights sum to 1\.3"):
        read_model(tmp_path / "wrong.json")


def test_records_of_models_without_a_first_observer_stay_the_same():
    plain = ModelSettings(name="a", kind="scenenet", protocol="operational")
    assert "first" not in plain.model_dump()
    assert "observed" not in plain.model_dump()["metric"]
    wire = ModelSettings(
        name="a", kind="scenenet", protocol="operational", geneos=("line",), first=("identity",),
        metric=WIRE,
    )  # fmt: skip
    assert wire.model_dump()["first"] == ("identity",)
    assert wire.model_dump()["metric"]["observed"] == 0.5


def test_a_model_in_voxels_learns_the_numbers_of_a_direction_by_gradient():
    model = SceneNet(("line",), (5, 9, 9), generator=torch.Generator().manual_seed(0))
    occupancy, _ = scene()
    model(occupancy).square().sum().backward()
    gradients = {n: float(p.grad) for n, p in model.named_parameters() if p.grad is not None}
    assert gradients
    assert all(g != 0 for g in gradients.values())


def test_answers_that_are_known_are_those_that_would_be_computed():
    occupancy, _ = scene()
    model, known = wire_model(), KnownAnswers()
    changes = (
        {},
        {"first.lambda.identity": 0.55, "first.lambda.ground": 0.25},
        {"first.canopy.r": 2.0},
        {"line.l": 6.0},
    )
    for change in changes:
        model.set_shape_parameters(NUMBERS | change)
        with torch.no_grad():
            found, expected = model.responder(known)(occupancy), model.responder()(occupancy)
        assert torch.equal(found, expected), change
