"""A SCENE-Net in metres: its constraints, its training, its file."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from scenenet.core.errors import InputError
from scenenet.geneo import kernel_named
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.model_file import ModelCard, read_model, write_model
from scenenet.models.predictions import probabilities, threshold_curve
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import MetricSettings, ModelSettings, SearchSettings, TuningSettings
from scenenet.training import metric_search
from scenenet.training.train import fit
from scenenet.training.tuning import choose

SMALL = MetricSettings(numbers="searched", radius=2.0, above=3.0, below=3.0)
"""All eleven numbers are searched; ``test_measured_numbers.py`` has those that are measured."""


def settings(generations: int = 6, **changes) -> ModelSettings:
    search = SearchSettings(searches=2, trial=2, starts=12, population=8, generations=generations)
    return ModelSettings(
        name="m", kind="scenenet", protocol="operational", metric=SMALL, search=search, **changes
    )


def net(seed: int = 0, lengths: MetricSettings = SMALL) -> SceneNet:
    return MetricSceneNet(metric=lengths, generator=torch.Generator().manual_seed(seed))


@pytest.fixture(scope="module")
def crops(pole_crops):
    return pole_crops(tuple(0.9 + 0.1 * i for i in range(4)))


@pytest.fixture(scope="module")
def searched(crops):
    """A model after a search, and its history."""
    return fit(crops[:3], crops[3:], settings(15), 0)


def assert_constrained(numbers: dict[str, float]) -> None:
    """Positive parameters and a convex combination (thesis 4.5)."""
    weights = [v for k, v in numbers.items() if k.startswith("lambda.")]
    assert min(weights) >= 0
    assert sum(weights) == pytest.approx(1, abs=1e-5)
    for name, value in numbers.items():
        if not name.startswith("lambda."):
            kernel, symbol = name.split(".")
            ranges = {p.name: p.metric_range for p in kernel_named(kernel).parameters}
            low, high = ranges[symbol]
            assert low * (1 - 1e-5) <= value <= high * (1 + 1e-5)
            assert value > 0


@given(st.lists(st.floats(-1e4, 1e4), min_size=11, max_size=11))
def test_the_constraints_hold_for_any_stored_numbers(raw):
    model = net()
    assert model.n_parameters() == 11
    model.set_numbers(np.array(raw))
    assert_constrained(model.shape_parameters())
    assert torch.isfinite(model.observer()[0]).all()


def test_the_constraints_hold_at_every_step_and_in_the_saved_model(searched, tmp_path):
    model, history = searched
    shown = list(model.shape_parameters())
    for _, row in history.iterrows():
        assert_constrained(row[shown].to_dict())
    card = card_for(model)
    write_model(tmp_path / "m.json", model, card)
    assert_constrained(read_model(tmp_path / "m.json")[0].shape_parameters())


def test_the_search_finds_the_poles_and_gets_no_worse(searched):
    model, history = searched
    assert history["epoch"].tolist() == list(range(1, 16))
    assert (history["loss"].diff().iloc[1:-1] <= 0).all()
    assert history["loss"].iloc[-1] < 0.4
    assert history["validation_f05"].iloc[-1] > 0.5
    assert model.shape_parameters()["cylinder.r"] == history["cylinder.r"].iloc[-1]


@pytest.mark.parametrize("seed", range(5))
def test_no_initial_model_is_dead(crops, seed):
    model, _ = fit(crops[:3], [], settings(2), seed)
    assert threshold_curve(model, crops[:3], "presence").best()[1].f05 > 0.3


def test_same_seed_same_numbers_and_other_seed_other_numbers(crops):
    (a, one), (b, two), (c, _) = (fit(crops[:1], crops[3:], settings(3), s) for s in (1, 1, 2))
    assert a.numbers().tolist() == b.numbers().tolist()
    assert a.numbers().tolist() != c.numbers().tolist()
    pd.testing.assert_frame_equal(
        one.drop(columns="seconds"), two.drop(columns="seconds"), check_exact=True
    )


class PowerCut(Exception):
    pass


def test_a_resumed_search_is_the_uninterrupted_one(crops, tmp_path, monkeypatch):
    straight, straight_history = fit(crops[:1], [], settings(5), 1)
    original, done = metric_search.advance, iter(range(2 * 2 + 1))  # trials and one more

    def interrupted(*args):
        if next(done, None) is None:
            raise PowerCut
        return original(*args)

    monkeypatch.setattr(metric_search, "advance", interrupted)
    with pytest.raises(PowerCut):
        fit(crops[:1], [], settings(5), 1, checkpoint=tmp_path / "c")
    monkeypatch.undo()
    monkeypatch.setattr(metric_search, "begin", None)  # a search that starts again fails
    resumed, history = fit(crops[:1], [], settings(5), 1, checkpoint=tmp_path / "c")
    assert resumed.numbers().tolist() == straight.numbers().tolist()
    pd.testing.assert_frame_equal(
        history.drop(columns="seconds"), straight_history.drop(columns="seconds"), check_exact=True
    )


def test_a_checkpoint_of_something_else_is_ignored(crops, tmp_path):
    another_seed, noise = tmp_path / "c", tmp_path / "noise"
    fit(crops[:1], [], settings(2), 7, checkpoint=another_seed)
    noise.write_bytes(another_seed.read_bytes()[:40])
    fresh, _ = fit(crops[:1], [], settings(2), 1)
    for checkpoint in (another_seed, noise):
        model, history = fit(crops[:1], [], settings(2), 1, checkpoint=checkpoint)
        assert len(history) == 2
        assert model.numbers().tolist() == fresh.numbers().tolist()


def test_half_the_voxel_size_covers_the_same_metres():
    model = net(1)
    fine = model.at(0.5)
    assert model.kernel_size == (7, 5, 5)
    assert fine.kernel_size == (13, 9, 9)
    assert fine.shape_parameters() == model.shape_parameters()
    assert fine.at(1.0).kernel_size == model.kernel_size
    # The same positions of the kernels; H is weighted by the voxel size.
    sphere, of_fine = model.kernels()[2], fine.kernels()[2]
    torch.testing.assert_close(of_fine[::2, ::2, ::2], sphere / 2)


def test_kernels_of_too_many_voxels_are_refused():
    """The default lengths on voxels of 2 cm: 54 million voxels."""
    with pytest.raises(InputError, match=r"601x301x301 voxels of 0\.02 m.*at most 64"):
        MetricSceneNet(metric=MetricSettings(numbers="searched")).at(0.02)


def test_a_model_of_fine_grids_has_the_kernels_of_the_blocks_that_it_observes(tmp_path):
    fine = card_for(net()).model_copy(update={"voxel_size": 0.02})
    write_model(tmp_path / "m.json", net(5), fine)
    again, card = read_model(tmp_path / "m.json")
    assert (card.voxel_size, again.voxel_size, again.kernel_size) == (0.02, 1.0, (7, 5, 5))
    assert json.loads((tmp_path / "m.json").read_text())["kernel_size"] == [7, 5, 5]


def test_a_model_at_another_voxel_size_shares_the_parameters():
    model = net(1)
    fine = model.at(0.5)
    model.set_numbers(np.zeros(11))
    assert fine.shape_parameters() == model.shape_parameters()


def test_a_column_of_a_given_height_has_the_same_response_on_every_grid():
    answers = []
    for voxel_size in (1.0, 0.5, 0.25):
        model = net(4).at(voxel_size)
        kz, ky, kx = model.kernel_size
        kernel = model.kernels()[0]  # the cylinder; each of its slices is the same
        inside = kernel[:, ky // 2, kx // 2]
        answers.append(inside[kz // 2 :][: round(3 / voxel_size)].sum().item())
    assert max(answers) / min(answers) < 1.2


def test_kernels_lie_within_their_lengths_and_sum_to_zero():
    lengths = MetricSettings(numbers="searched", radius=2.0, above=4.0, below=2.0)
    kernels = net(2, lengths).kernels()
    assert kernels.shape[1:] == (9, 5, 5)
    assert (kernels[:, :2] == 0).all()  # 2 m down, 4 m up
    assert (kernels[:, 2:].abs().sum(dim=(0, 2, 3)) > 0).all()
    assert (kernels[:, :, 0, 0] == 0).all()  # a disc has no corners
    assert kernels[:2].sum(dim=(2, 3)).abs().max() < 1e-5
    torch.testing.assert_close(kernels.rot90(1, (2, 3)), kernels)


def test_an_empty_voxel_has_probability_0(crops):
    probability, _ = probabilities(net(3), crops[0], "presence")
    empty = np.ones(len(probability), bool)
    empty[crops[0].index] = False
    assert (probability[empty] == 0).all()
    assert probability.max() <= 1


def card_for(model: SceneNet) -> ModelCard:
    return ModelCard(
        name="m", codes="edp", measurement="presence", fit="cube", resolution=64,
        voxel_size=0.9, tau=0.5,
    )  # fmt: skip


def test_its_file_has_units_of_metres_and_reads_back(tmp_path):
    model = net(5)
    write_model(tmp_path / "m.json", model, card_for(model))
    written = json.loads((tmp_path / "m.json").read_text())
    assert written["units"] == "m"
    assert written["format_version"] == 4
    assert written["metric"]["radius"] == 2.0
    radius, sigma = (written["geneos"][0]["parameters"][s] for s in ("r", "sigma"))
    assert (radius["unit"], sigma["unit"]) == ("m", "m^2")
    assert radius["value"] == pytest.approx(model.shape_parameters()["cylinder.r"])
    again, _ = read_model(tmp_path / "m.json")
    assert again.metric == SMALL
    assert again.voxel_size == 0.9
    torch.testing.assert_close(again.observer()[0], model.at(0.9).observer()[0])


def test_a_file_of_version_0_1_reads_back(tmp_path):
    """In this file the lengths are called ``field``, with format version 2."""
    model = net(5)
    write_model(tmp_path / "m.json", model, card_for(model))
    written = json.loads((tmp_path / "m.json").read_text())
    old = written | {"format_version": 2, "field": written.pop("metric")}
    (tmp_path / "old.json").write_text(json.dumps(old))
    again, card = read_model(tmp_path / "old.json")
    assert again.metric == SMALL
    assert card == card_for(model)
    torch.testing.assert_close(again.observer()[0], model.at(0.9).observer()[0])


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [("r", -1.0, "does not lie within"), ("sigma", 99.0, "does not lie within")],
)
def test_a_file_with_a_number_out_of_bounds_is_refused(tmp_path, name, value, message):
    write_model(tmp_path / "m.json", net(), card_for(net()))
    written = json.loads((tmp_path / "m.json").read_text())
    written["geneos"][0]["parameters"][name]["value"] = value
    (tmp_path / "m.json").write_text(json.dumps(written))
    with pytest.raises(InputError, match=message):
        read_model(tmp_path / "m.json")


def test_a_model_in_metres_has_no_other_kernel_size():
    with pytest.raises(InputError, match="in metres"):
        net().with_kernel_size((9, 9, 9))


def test_tau_is_chosen_on_the_training_crops_as_well(crops, searched):
    model, _ = searched
    sizes = TuningSettings(kernel_sizes=((9, 5, 5),))
    _, card, result = choose(model, card_for(model), crops[3:], sizes, crops[:3])
    everything = threshold_curve(model, crops, "presence")
    assert len(result.kernel_sizes) == 1
    assert card.tau in everything.tau
    assert result.validation.n_samples == 1
