"""SCENE-Net and the CNN: number of parameters, probabilities and equivariance."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from scenenet.convolution.occupancy import Occupancy
from scenenet.core.errors import InputError
from scenenet.models.cnn import CNN
from scenenet.models.factory import new_model
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import ModelSettings

ALL = ["cylinder", "arrow", "negative_sphere"]
ROOM = (12, 14, 14)
EXACT = 1e-5


def seeded(seed: int, size=(9, 9, 9), geneos=ALL) -> SceneNet:
    return SceneNet(geneos, size, generator=torch.Generator().manual_seed(seed))


def volume(seed: int, shape=ROOM, share: float = 0.05) -> np.ndarray:
    return np.random.default_rng(seed).random(shape) < share


def occupancy(*volumes: np.ndarray) -> Occupancy:
    indices = [np.flatnonzero(v) for v in volumes]
    return Occupancy.of_grids(indices, [np.ones(len(i)) for i in indices], volumes[0].shape)


def predicted(model, *volumes) -> torch.Tensor:
    with torch.no_grad():
        return model(occupancy(*volumes))


def test_scene_net_has_eleven_trained_numbers():
    model = SceneNet()
    assert model.n_parameters() == 11
    named = model.shape_parameters()
    assert sorted(named) == sorted([
        "cylinder.r", "cylinder.sigma",
        "arrow.r", "arrow.sigma", "arrow.r_c", "arrow.beta",
        "negative_sphere.r", "negative_sphere.sigma", "negative_sphere.omega",
        "lambda.cylinder", "lambda.arrow", "lambda.negative_sphere",
    ])  # fmt: skip


def test_the_cnn_has_2190_parameters():
    assert CNN().n_parameters() == 2190


def test_gradients_reach_all_eleven_numbers():
    model = seeded(0)
    kernel, _ = model.observer()
    (kernel * torch.rand(kernel.shape, generator=torch.Generator().manual_seed(0))).sum().backward()
    gradients = [p.grad for p in model.parameters()]
    assert len(gradients) == 11
    assert all(g is not None and abs(g) > 1e-6 for g in gradients)


@given(st.integers(0, 10_000))
def test_mixing_weights_sum_to_one(seed):
    weights = seeded(seed).mixing_weights()
    assert weights.shape == (3,)
    assert weights.sum().item() == pytest.approx(1.0, abs=1e-6)


@given(st.integers(0, 10_000))
def test_numbers_are_drawn_from_the_ranges_of_the_kernels(seed):
    numbers = seeded(seed).shape_parameters()
    assert 0.2 <= numbers["cylinder.r"] <= 2.0
    assert 0.1 <= numbers["arrow.beta"] <= 0.9
    assert 0.05 <= numbers["negative_sphere.omega"] <= 0.15


@pytest.mark.parametrize(
    "make", [seeded, lambda s: CNN(generator=torch.Generator().manual_seed(s))]
)
def test_a_probability_lies_between_0_and_1(make):
    probability = predicted(make(1), volume(1), volume(2, share=0.9))
    assert probability.shape == (2, *ROOM)
    assert probability.min() >= 0
    assert probability.max() <= 1
    assert probability.max() > 0


def test_an_empty_scene_has_no_tower():
    assert predicted(seeded(1), np.zeros(ROOM, bool)).max() == 0


def test_the_probability_is_tanh_and_relu_of_the_mixed_responses():
    model = seeded(3)
    scene = occupancy(volume(3))
    with torch.no_grad():
        observed = model.contributions(scene).sum(dim=0)
        expected = torch.tanh(observed).clamp(min=0)
        torch.testing.assert_close(model(scene), expected, rtol=0, atol=EXACT)


def test_contributions_are_mixing_weight_times_response():
    model = seeded(4)
    scene = occupancy(volume(4))
    with torch.no_grad():
        parts = model.contributions(scene)
        kernels, weights = model.kernels(), model.mixing_weights()
        dense = scene.dense(torch.float32)[:, None]
        responses = torch.nn.functional.conv3d(dense, kernels[:, None], padding="same")[0]
    assert parts.shape == (3, 1, *ROOM)
    torch.testing.assert_close(
        parts[:, 0], weights[:, None, None, None] * responses, rtol=0, atol=EXACT
    )


def test_the_cnn_is_torchs_conv3d_summed():
    model = CNN(3, (3, 5, 5), generator=torch.Generator().manual_seed(0))
    scene = occupancy(volume(5))
    with torch.no_grad():
        responses = torch.nn.functional.conv3d(
            scene.dense(torch.float32)[:, None], model.weight[:, None], model.bias, padding="same"
        )
        expected = responses.sum(dim=1).tanh().clamp(min=0)
        torch.testing.assert_close(model(scene), expected, rtol=0, atol=EXACT)


@given(st.integers(0, 1000), st.sampled_from([(9, 9, 9), (8, 5, 5), (5, 7, 7)]))
def test_a_rotated_crop_gives_the_rotated_prediction(seed, size):
    model = seeded(seed, size)
    scene = volume(seed)
    turned = np.rot90(scene, axes=(1, 2))
    expected = torch.rot90(predicted(model, scene), dims=(2, 3))
    torch.testing.assert_close(predicted(model, turned), expected, rtol=0, atol=EXACT)


def test_a_crop_on_its_side_does_not_give_the_prediction_on_its_side():
    # Towers are vertical: only rotations about the vertical are a symmetry.
    scene = volume(7, (14, 14, 14))
    expected = torch.rot90(predicted(seeded(2), scene), dims=(1, 2))
    on_its_side = predicted(seeded(2), np.rot90(scene, axes=(0, 1)))
    assert (on_its_side - expected).abs().max() > 0.1


def test_an_untrained_cnn_is_not_equivariant_under_rotation():
    model = CNN(generator=torch.Generator().manual_seed(0))
    scene = volume(3)
    turned = predicted(model, np.rot90(scene, axes=(1, 2)))
    assert (turned - torch.rot90(predicted(model, scene), dims=(2, 3))).abs().max() > 0.01


@given(st.integers(0, 1000), st.tuples(*[st.integers(0, 4)] * 3))
def test_a_translated_crop_gives_the_translated_prediction(seed, shift):
    model = seeded(seed, (5, 5, 5))
    room = np.zeros((22, 22, 22), bool)
    room[6:12, 6:12, 6:12] = volume(seed, (6, 6, 6), 0.2)
    expected = torch.roll(predicted(model, room), shift, dims=(1, 2, 3))
    moved = predicted(model, np.roll(room, shift, axis=(0, 1, 2)))
    torch.testing.assert_close(moved, expected, rtol=0, atol=EXACT)


def test_order_of_the_batch_does_not_matter():
    model = seeded(1)
    one, two = volume(1), volume(2)
    assert torch.equal(predicted(model, one, two), predicted(model, two, one).flip(0))


def test_a_geneo_may_be_repeated():
    model = seeded(0, geneos=["cylinder", "cylinder", "negative_sphere"])
    assert model.names == ["cylinder", "cylinder_2", "negative_sphere"]
    assert model.n_parameters() == 2 + 2 + 3 + 2
    numbers = model.shape_parameters()
    assert numbers["cylinder.r"] != numbers["cylinder_2.r"]


def test_a_single_geneo_has_the_weight_one():
    model = seeded(0, geneos=["cylinder"])
    assert model.n_parameters() == 2
    assert model.mixing_weights().tolist() == [1.0]


def test_a_scene_net_without_geneos_is_refused():
    with pytest.raises(InputError, match="at least one"):
        SceneNet([])


def test_another_kernel_size_keeps_the_parameters():
    model = seeded(5)
    taller = model.with_kernel_size((15, 5, 5))
    assert taller.shape_parameters() == model.shape_parameters()
    assert taller.observer()[0].shape == (15, 5, 5)
    assert model.kernel_size == (9, 9, 9)
    # The inner part of the sphere does not depend on the kernel size.
    assert torch.equal(taller.kernels()[2][3:12], model.kernels()[2][:, 2:7, 2:7])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda n: n.pop("arrow.beta"), "missing: arrow.beta"),
        (lambda n: n.update({"arrow.h": 1.0}), "unknown: arrow.h"),
        (lambda n: n.update({"lambda.arrow": 3.0}), "sum to .*, not to 1"),
    ],
)
def test_numbers_that_do_not_make_a_scene_net_are_refused(change, message):
    model = seeded(0)
    numbers = model.shape_parameters()
    change(numbers)
    with pytest.raises(InputError, match=message):
        model.set_shape_parameters(numbers)


@pytest.mark.parametrize("kind", ["scenenet", "cnn"])
def test_a_seed_gives_the_same_model_and_another_seed_another(kind):
    settings = ModelSettings(name="m", kind=kind)
    one, same, other = (new_model(settings, seed) for seed in (1, 1, 2))
    assert one.kind == kind
    for a, b, c in zip(one.parameters(), same.parameters(), other.parameters(), strict=True):
        assert torch.equal(a, b)
        assert not torch.equal(a, c)
