"""The certificate of models with known properties (thesis 3.4, 4.3 to 4.5)."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest
import torch

from scenenet.core.errors import InputError
from scenenet.interpretability.equivariance import Scene, sample_scene
from scenenet.interpretability.geneo_properties import certify
from scenenet.models.cnn import CNN
from scenenet.models.scenenet import SceneNet

SIZES = [(9, 9, 9), (9, 5, 5), (13, 7, 7)]
WEIGHTS = {"cylinder": 0.5, "arrow": 0.2, "negative_sphere": 0.3}


def scenenet(size=(9, 9, 9), seed: int = 0, weights=WEIGHTS) -> SceneNet:
    model = SceneNet(kernel_size=size, generator=torch.Generator().manual_seed(seed))
    numbers = model.shape_parameters() | {f"lambda.{n}": w for n, w in weights.items()}
    model.set_shape_parameters(numbers)
    return model


def cnn(seed: int = 0) -> CNN:
    return CNN(3, (5, 5, 5), generator=torch.Generator().manual_seed(seed))


def holds(certificate, about: str) -> bool:
    (found,) = (s for s in certificate.statements() if about in s.property)
    return found.holds


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("measurement", ["presence", "density"])
def test_a_scenenet_is_equivariant_under_translation_and_quarter_turns(size, measurement):
    found = certify(scenenet(size), measurement=measurement)
    assert found.translation_error < 1e-5
    assert found.quarter_turn_error < 1e-5
    assert found.kernel_turn_error < 1e-6
    assert found.translates
    assert found.turns_by_quarters


@pytest.mark.parametrize("size", [(9, 6, 6), (9, 5, 7)])
def test_a_kernel_that_is_not_square_and_odd_is_not_equivariant(size):
    found = certify(scenenet(size))
    assert found.translates
    assert found.kernel_turn_error == 1
    assert found.quarter_turn_error > 0.05
    assert not holds(found, "quarter turns")


def test_a_cnn_is_equivariant_under_translation_only():
    found = certify(cnn())
    assert found.translates
    assert not found.turns_by_quarters
    assert found.kernel_turn_error > 0.5
    assert found.quarter_turn_error > 0.1
    assert found.turns[-1].degrees == 90
    assert found.turns[-1].mean_h > 0.1


def test_other_rotations_and_half_voxel_shifts_are_not_exact():
    found = certify(scenenet(), tau=0.5)
    by_angle = {turn.degrees: turn for turn in found.turns}
    for exact in (0.0, 90.0):
        assert by_angle[exact].mean_h < 1e-5
        assert by_angle[exact].largest_m < 1e-4
        assert by_angle[exact].decision_changed == pytest.approx(0, abs=1e-3)
    for angle in (15.0, 30.0, 45.0, 60.0, 75.0):
        assert 0.01 < by_angle[angle].mean_h < 1
        assert by_angle[angle].decision_changed > 0
    assert found.half_voxel.degrees is None
    assert found.half_voxel.mean_h > 0.01
    assert not holds(found, "any rotation")


def test_a_scenenet_changes_less_under_rotation_than_a_free_kernel():
    def worst(model) -> float:
        return max(turn.mean_h for turn in certify(model, angles=(30.0, 45.0)).turns)

    assert worst(scenenet((5, 5, 5))) < worst(cnn())


def test_the_measured_angles_do_not_depend_on_the_voxel_size():
    found = certify(scenenet(), voxel_size=0.5, angles=(33.0,))
    assert [turn.degrees for turn in found.turns] == [33.0]


def brute_force(kernel: np.ndarray) -> float:
    """The largest difference of k * phi at the anchor over all pairs of phi in {0, 1}."""
    elements = kernel.reshape(-1)
    responses = [np.dot(elements, phi) for phi in itertools.product((0, 1), repeat=len(elements))]
    return max(responses) - min(responses)


@pytest.mark.parametrize("size", [(1, 3, 3), (3, 2, 2)])
def test_the_constant_is_the_worst_over_all_pairs_of_measurements(size):
    model = scenenet(size)
    found = certify(model)
    with torch.no_grad():
        kernel = model.observer()[0].double().numpy()
    assert found.l1 == pytest.approx(brute_force(kernel), rel=1e-6)
    assert found.measured == pytest.approx(found.l1, rel=1e-6)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("seed", range(3))
def test_the_bound_is_reached_and_never_passed(size, seed):
    found = certify(scenenet(size, seed), angles=(), seed=seed)
    assert found.measured == pytest.approx(found.l1, rel=1e-6)
    assert found.measured_model == pytest.approx(found.l1, rel=1e-3)
    assert 0 < found.measured_random < found.l1
    assert found.l1 <= found.l1_bound * (1 + 1e-6)
    assert found.one_voxel < found.l1
    assert found.highest_h - found.lowest_h == pytest.approx(found.l1)


def test_only_the_normalised_observer_is_non_expansive():
    weights = {"cylinder": 1.0, "arrow": 0.0, "negative_sphere": 0.0}
    model = scenenet(weights=weights)
    found = certify(model, tau=0.9)
    assert found.highest_h == pytest.approx(found.l1 / 2, rel=1e-4)  # zero sum
    assert found.lowest_h == pytest.approx(-found.l1 / 2, rel=1e-4)
    assert found.l1 > 1
    assert not found.non_expansive
    assert not holds(found, "observer H")
    assert holds(found, "decisions are those")
    assert found.normalised_tau == pytest.approx(math.atanh(0.9) / found.l1)


def test_a_small_kernel_is_non_expansive():
    class Quiet(CNN):
        def observer(self):
            kernel, bias = super().observer()
            return kernel / kernel.abs().sum(), bias * 0

    found = certify(Quiet(2, (3, 3, 3), generator=torch.Generator().manual_seed(0)))
    assert found.l1 == pytest.approx(1)
    assert found.measured == pytest.approx(1)
    assert holds(found, "observer H")


def test_the_model_is_non_expansive_for_presence_only():
    assert holds(certify(scenenet(), angles=()), "model M")
    assert not holds(certify(scenenet(), measurement="density", angles=()), "model M")


@pytest.mark.parametrize("bias", [-0.2, 0.0, 0.2])
def test_the_constant_of_a_model_with_a_bias_is_that_of_its_kernel(bias):
    model = cnn()
    with torch.no_grad():
        model.bias.fill_(bias)
    found = certify(model, angles=())
    assert found.measured_model == pytest.approx(found.l1, rel=1e-3)
    with torch.no_grad():
        kernel = model.observer()[0]
    assert found.highest_h == pytest.approx(float(kernel.clamp(min=0).sum()) + 3 * bias, abs=1e-5)


def test_mixing_weights_in_bounds_are_convex():
    found = certify(scenenet(), angles=())
    assert found.convex
    assert found.negative == ()
    assert {k.name: pytest.approx(k.weight) for k in found.kernels} == WEIGHTS
    assert sum(k.share for k in found.kernels) == pytest.approx(1)
    assert all(k.share >= 0 for k in found.kernels)
    assert holds(found, "convex")


def test_a_negative_mixing_weight_is_named():
    weights = {"cylinder": 0.8, "arrow": 0.5, "negative_sphere": -0.3}
    found = certify(scenenet(weights=weights), angles=())
    assert found.weight_sum == pytest.approx(1)
    assert found.negative == ("negative_sphere",)
    assert not found.convex
    (statement,) = (s for s in found.statements() if "convex" in s.property)
    assert "negative: negative_sphere" in statement.text


def test_weights_that_do_not_sum_to_one_are_not_convex():
    found = certify(scenenet(), angles=())
    assert not replace(found, weight_sum=0.99).convex


def test_normalised_weights_belong_to_kernels_of_norm_one():
    model = scenenet()
    found = certify(model, angles=())
    with torch.no_grad():
        kernels, summed = model.kernels().double(), model.observer()[0].double()
    unit = [g / g.abs().sum() for g in kernels]
    mixed = sum(k.share * g for k, g in zip(found.kernels, unit, strict=True))
    torch.testing.assert_close(mixed * found.l1_bound, summed, rtol=1e-4, atol=1e-5)
    assert mixed.abs().sum() <= 1 + 1e-9


def test_cylinder_and_arrow_sum_to_zero_and_the_sphere_does_not():
    found = certify(scenenet(), angles=())
    kernels = {k.name: k for k in found.kernels}
    assert kernels["cylinder"].slice_sum < 1e-4
    assert kernels["arrow"].slice_sum < 1e-4
    assert abs(kernels["negative_sphere"].total) > 0.1
    assert holds(found, "sum to zero")


def test_a_model_without_geneos_has_no_mixing_weights():
    found = certify(cnn(), angles=())
    assert found.kernels == ()
    assert found.weight_sum is None
    assert not found.convex
    assert not [s for s in found.statements() if "convex" in s.property or "zero" in s.property]


def test_certify_is_reproducible_and_has_plain_values():
    one, other = (certify(scenenet(), tau=0.7) for _ in range(2))
    assert one == other
    plain = json.loads(json.dumps(asdict(one), allow_nan=False))
    assert plain["l1"] == one.l1
    for statement in one.statements():
        assert statement.property
        assert statement.text
        assert "4." in statement.thesis or "3." in statement.thesis


def test_a_model_without_response_has_a_certificate():
    class Dead(CNN):
        def observer(self):
            kernel, bias = super().observer()
            return kernel * 0, bias * 0

    found = certify(Dead(1, (3, 3, 3)), tau=0.5)
    assert found.l1 == found.measured == found.translation_error == 0
    assert found.normalised_tau is None
    assert not holds(found, "decisions are those")
    json.dumps(asdict(found), allow_nan=False)


def test_a_scene_in_map_coordinates_is_centred():
    near = certify(scenenet(), sample_scene(), angles=(45.0,))
    far = certify(
        scenenet(), sample_scene() + np.array([500_000.0, 4_630_000.0, 100.0]), angles=(45.0,)
    )
    assert far.turns[0].mean_h == pytest.approx(near.turns[0].mean_h, rel=0.05)


def test_every_turn_of_a_scene_stays_inside_its_grid():
    scene = Scene.of(sample_scene(), 1.0, "presence")
    low = np.asarray(scene.grid.origin)
    high = low + scene.grid.voxel_size * np.array(scene.grid.shape)[::-1]
    for degrees in range(0, 360, 7):
        turned = scene.turned(degrees)
        assert (turned > low).all()
        assert (turned < high).all()
        np.testing.assert_allclose(turned[:, 2], scene.xyz[:, 2])


def test_invalid_scenes_are_refused():
    with pytest.raises(InputError, match="no points"):
        certify(scenenet(), np.empty((0, 3)))
    with pytest.raises(InputError, match="voxels"):
        certify(scenenet(), np.array([[0.0, 0, 0], [1e6, 1e6, 10]]))


def test_a_real_crop_has_a_certificate(real_data):
    from scenenet.pointcloud import read

    cloud = read(real_data / "ts40k" / "sample_593.npy", "edp")
    found = certify(scenenet((13, 7, 7)), cloud.xyz, voxel_size=0.8, tau=0.9, angles=(45.0, 90.0))
    assert found.translates
    assert found.turns_by_quarters
    assert found.turns[1].mean_h < 0.02 < found.turns[0].mean_h < 1
