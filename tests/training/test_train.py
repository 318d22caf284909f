"""Training is reproducible, also after an interruption, and the loss falls."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import torch

from scenenet.core.errors import InputError
from scenenet.dataset.batches import batch
from scenenet.dataset.voxels import VoxelGrid, VoxelSettings, voxelise
from scenenet.models.model_file import read_model
from scenenet.models.predictions import probabilities, threshold_curve
from scenenet.models.settings import LossSettings, ModelSettings, TrainingSettings
from scenenet.training import gradient
from scenenet.training.gradient import LostTraining
from scenenet.training.losses import VoxelWeights, fidelity
from scenenet.training.train import fit, train


@pytest.fixture(scope="module")
def crops(pole_crops):
    return pole_crops()


def settings(kind="scenenet", epochs=6, **changes) -> ModelSettings:
    protocol = {"batch_size": 2, "learning_rate": 0.01} | changes
    return ModelSettings(
        name="m",
        kind=kind,
        kernel_size=(5, 5, 5),
        training=TrainingSettings(epochs=epochs, **protocol),
    )


def numbers(model) -> list[float]:
    return torch.cat([p.detach().flatten() for p in model.parameters()]).tolist()


def test_the_loss_falls_on_a_pole_in_a_field(crops):
    _, history = fit(crops[:3], crops[3:], settings(epochs=30), seed=0)
    assert history["fidelity"].iloc[-1] < 0.7 * history["fidelity"].iloc[0]
    assert history["validation_loss"].iloc[-1] < history["validation_loss"].iloc[0]
    assert history["validation_f05"].iloc[-1] > 0.5


@pytest.mark.parametrize("kind", ["scenenet", "cnn"])
def test_same_seed_same_numbers_and_other_seed_other_numbers(crops, kind):
    (a, history_a), (b, history_b), (c, _) = (
        fit(crops[:3], crops[3:], settings(kind, epochs=3), seed) for seed in (1, 1, 2)
    )
    assert numbers(a) == numbers(b)
    assert numbers(a) != numbers(c)
    timeless = [h.drop(columns="seconds") for h in (history_a, history_b)]
    pd.testing.assert_frame_equal(*timeless, check_exact=True)


class PowerCut(Exception):
    pass


@pytest.fixture
def cut_after(monkeypatch):
    """A function that makes training stop in the middle of the epoch after ``n`` whole ones."""

    def arrange(n: int):
        original = gradient._epoch
        done = iter(range(n))

        def interrupted(*args):
            if next(done, None) is None:
                original(*args)  # the parameters have changed since the last checkpoint
                raise PowerCut
            return original(*args)

        monkeypatch.setattr(gradient, "_epoch", interrupted)
        return monkeypatch.undo

    return arrange


@pytest.mark.parametrize("kind", ["scenenet", "cnn"])
@pytest.mark.parametrize(
    "changes",
    [
        {"optimiser": "rmsprop"},
        {"optimiser": "adam"},
        {"optimiser": "sgd"},
        {"decay": 0.5, "decay_every": 1},
        {
            "decay": 0.25,
            "decay_every": 3,
        },  # the next decrease of the rate is after the interruption
        {"loss": LossSettings(fidelity="cross_entropy", penalty="quadratic")},
    ],
    ids=str,
)
def test_a_resumed_training_is_the_uninterrupted_one(crops, cut_after, tmp_path, kind, changes):
    chosen = settings(kind, epochs=5, **changes)
    straight, straight_history = fit(crops[:3], crops[3:], chosen, 1)
    undo = cut_after(2)
    with pytest.raises(PowerCut):
        fit(crops[:3], crops[3:], chosen, 1, checkpoint=tmp_path / "c")
    undo()
    resumed, history = fit(crops[:3], crops[3:], chosen, 1, checkpoint=tmp_path / "c")
    assert numbers(resumed) == numbers(straight)
    assert history["epoch"].tolist() == [1, 2, 3, 4, 5]
    pd.testing.assert_frame_equal(
        history.drop(columns="seconds"), straight_history.drop(columns="seconds"), check_exact=True
    )


def test_the_rate_is_that_of_torchs_own_schedule():
    chosen = TrainingSettings(learning_rate=0.4, decay=0.25, decay_every=3)
    optimiser = torch.optim.SGD([torch.zeros(1, requires_grad=True)], lr=0.4)
    schedule = torch.optim.lr_scheduler.StepLR(optimiser, step_size=3, gamma=0.75)
    for epoch in range(1, 12):
        assert chosen.rate(epoch) == pytest.approx(optimiser.param_groups[0]["lr"])
        optimiser.step()
        schedule.step()
    assert {TrainingSettings(learning_rate=0.4).rate(epoch) for epoch in range(1, 99)} == {0.4}


def test_a_rate_that_has_decayed_moves_less(crops):
    whole, decayed = (
        fit(crops[:3], [], settings(epochs=4, decay=share, decay_every=1), 0)[1]
        for share in (0.0, 0.9)
    )
    assert whole["cylinder.r"].iloc[0] == decayed["cylinder.r"].iloc[0]
    steps = [h["cylinder.r"].diff().abs().iloc[-1] for h in (whole, decayed)]
    assert 0 < steps[1] < 0.1 * steps[0]


@pytest.mark.parametrize("kind", ["scenenet", "cnn"])
def test_cross_entropy_falls_and_is_the_validation_loss(crops, kind):
    init = "informed" if kind == "cnn" else "thesis"
    chosen = settings(kind, epochs=30, init=init, loss=LossSettings(fidelity="cross_entropy"))
    model, history = fit(crops[:3], crops[3:], chosen, seed=0)
    assert history["fidelity"].iloc[-1] < 0.9 * history["fidelity"].iloc[0]
    occupancy, towers = batch(crops[3:], "presence")
    n_tower, n = sum(t.labelled.sum() for t in crops[:3]), sum(t.grid.n_voxels for t in crops[:3])
    weights = VoxelWeights.of_counts(n_tower, n, alpha=5.0, epsilon=0.1)
    with torch.no_grad():
        recomputed = fidelity(model, occupancy, towers, weights, "cross_entropy").item()
    assert history["validation_loss"].iloc[-1] == pytest.approx(recomputed)


@pytest.mark.parametrize("what", ["settings", "seed", "samples", "nothing but noise"])
def test_a_checkpoint_of_something_else_is_ignored(crops, cut_after, tmp_path, what):
    checkpoint = tmp_path / "c"
    chosen = settings(epochs=3)
    other_settings = settings(epochs=3, loss=LossSettings(alpha=1.0))
    undo = cut_after(2)
    with pytest.raises(PowerCut):
        fit(
            crops[1:] if what == "samples" else crops[:3],
            [],
            other_settings if what == "settings" else chosen,
            7 if what == "seed" else 1,
            checkpoint=checkpoint,
        )
    undo()
    assert checkpoint.is_file()
    if what == "nothing but noise":
        checkpoint.write_bytes(checkpoint.read_bytes()[:50])
    fresh, _ = fit(crops[:3], [], chosen, 1)
    model, history = fit(crops[:3], [], chosen, 1, checkpoint=checkpoint)
    assert len(history) == 3
    assert numbers(model) == numbers(fresh)


def test_a_training_that_diverges_is_refused(crops):
    """The loss of the first epoch is that of the start, and the step after it overflows."""
    chosen = settings(epochs=1, optimiser="sgd", learning_rate=1e38, batch_size=3)
    with pytest.raises(LostTraining, match=r"m from seed 1 diverged: after epoch 1 .*lower"):
        fit(crops[:3], [], chosen, 1)


def test_history_has_a_row_per_epoch_and_a_column_per_parameter(crops):
    model, history = fit(crops[:3], crops[3:], settings(epochs=4), 0)
    assert history["epoch"].tolist() == [1, 2, 3, 4]
    assert history.columns[:7].tolist() == [
        "epoch", "loss", "fidelity", "penalty", "seconds", "validation_loss", "validation_f05",
    ]  # fmt: skip
    assert history.columns[7:].tolist() == list(model.shape_parameters())
    last = history.iloc[-1]
    assert last["cylinder.r"] == model.shape_parameters()["cylinder.r"]
    np.testing.assert_allclose(history["loss"], history["fidelity"] + history["penalty"], rtol=1e-6)


def test_a_cnn_has_no_columns_for_its_2190_numbers(crops):
    _, history = fit(crops[:3], [], settings("cnn", epochs=1), 0)
    assert len(history.columns) == 7
    assert np.isnan(history["validation_loss"].iloc[0])


@pytest.mark.parametrize("poles", ["no crop", "no pole"])
def test_training_without_tower_voxels_is_refused(scene, poles):
    cloud = scene(poles=())
    samples = [voxelise(cloud, VoxelGrid.metric(cloud.xyz, 1.0))] if poles == "no pole" else []
    with pytest.raises(InputError, match=r"no tower voxel in the \d training crops.*class scheme"):
        fit(samples, [], settings(), 0)


def test_order_of_validation_samples_does_not_matter(crops, pole_finder):
    model, _ = pole_finder
    forth = threshold_curve(model, crops, "presence")
    back = threshold_curve(model, crops[::-1], "presence")
    np.testing.assert_array_equal(forth.true, back.true)
    np.testing.assert_array_equal(forth.false, back.false)
    assert forth.true.sum() == sum(s.labelled.sum() for s in crops)
    assert forth.true.sum() + forth.false.sum() == sum(s.grid.n_voxels for s in crops)


def test_crops_of_different_sizes_are_predicted_alike_in_a_batch_and_alone(scene, pole_finder):
    clouds = [scene(((8.5, 8.5),), size=(20, 17), tree=None), scene(size=(30, 30))]
    samples = [voxelise(c, VoxelGrid.metric(c.xyz, 1.0)) for c in clouds]
    model, _ = pole_finder
    occupancy, towers = batch(samples, "presence")
    assert occupancy.shape == tuple(np.max([s.grid.shape for s in samples], axis=0))
    with torch.no_grad():
        together = model(occupancy).numpy()
    for volume, sample in zip(together, samples, strict=True):
        alone, truth = probabilities(model, sample, "presence")
        z, y, x = sample.grid.shape
        np.testing.assert_array_equal(volume[:z, :y, :x].ravel(), alone)
        assert truth.sum() == sample.labelled.sum()
    flat = together.reshape(-1)
    assert len(towers) == sum(s.labelled.sum() for s in samples)
    expected = [probabilities(model, s, "presence")[0][s.labelled_index()] for s in samples]
    np.testing.assert_array_equal(flat[towers], np.concatenate(expected))


def test_training_writes_model_and_history_and_removes_its_checkpoint(dataset_files, tmp_path):
    out = {name: tmp_path / name for name in ("model.json", "history.csv", "checkpoint")}
    train(
        [dataset_files.voxels], dataset_files.split, settings(epochs=2), 3, out["model.json"],
        out["history.csv"], out["checkpoint"], VoxelSettings(fit="metric", voxel_size=1.0),
        {"config": "abc"},
    )  # fmt: skip
    model, card = read_model(out["model.json"])
    history = pd.read_csv(out["history.csv"])
    assert len(history) == 2
    assert history["arrow.beta"].iloc[-1] == pytest.approx(model.shape_parameters()["arrow.beta"])
    assert not out["checkpoint"].exists()
    assert card.voxel_size == 1.0
    assert card.codes == "edp"
    assert card.tau is None
    assert card.provenance["seed"] == 3
    assert card.provenance["config"] == "abc"
    assert card.provenance["training_crops"] == 2  # only those of the training part
