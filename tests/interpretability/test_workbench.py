"""What the workbench calculates, against kernels that are simple enough to know."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from scenenet.convolution.convolve import convolve
from scenenet.convolution.occupancy import Occupancy
from scenenet.geneo import kernel_named
from scenenet.interpretability.geneo_properties import certify
from scenenet.interpretability.workbench.description import KernelFacts, side_view, top_view
from scenenet.interpretability.workbench.moved_scenes import measured_equivariance
from scenenet.interpretability.workbench.one_kernel import OneKernel


def test_the_facts_of_a_kernel_are_those_of_its_values():
    kernel = torch.zeros(3, 3, 3)
    kernel[0, 1, 1], kernel[0, 1, 2], kernel[2, 0, 0] = 4.0, -4.0, 2.0
    facts = KernelFacts.of(kernel[None], 0.5)
    assert (facts.total, facts.l1, facts.lowest, facts.highest) == (2.0, 10.0, -4.0, 4.0)
    assert facts.slice_sum == 2.0
    assert not facts.sums_to_zero
    # A quarter turn puts -4 where 0 was: the change is as large as the largest value.
    assert facts.quarter_turn_error == 1.0
    kernel[2, 0, 0] = 0.0
    assert KernelFacts.of(kernel[None], 0.5).sums_to_zero


def test_slices_are_drawn_with_up_and_north_at_the_top():
    kernel = np.zeros((3, 3, 3))
    kernel[2, 1, 0], kernel[0, 1, 2], kernel[0, 2, 1] = 0.5, -1.0, 0.01
    assert [line.split() for line in side_view(kernel)] == [
        ["4", ".", "."],
        [".", ".", "."],
        [".", ".", "-9"],
    ]
    row, top = top_view(kernel)
    assert row == 0
    assert [line.split() for line in top] == [[".", "+", "."], [".", ".", "-9"], [".", ".", "."]]


def test_the_answer_of_one_kernel_is_its_convolution():
    chosen = OneKernel("cylinder", {"r": 0.4})
    assert chosen.values["r"] == pytest.approx(0.4, rel=1e-5)
    low, high = 0.001, 10.0  # of sigma, whose value is not given
    assert chosen.values["sigma"] == pytest.approx((low * high) ** 0.5, rel=1e-4)
    rng = np.random.default_rng(3)
    index = np.flatnonzero(rng.random(12 * 10 * 11) < 0.1)
    scene = Occupancy.of_grids([index], None, (12, 10, 11))
    expected = convolve(scene, chosen.sampled()).reshape(-1).numpy()[index]
    assert np.allclose(chosen.answers(scene), expected, atol=1e-5)


def test_a_kernel_that_looks_to_one_side_is_not_equivariant(tmp_path, monkeypatch):
    from scenenet.core.provided_code import KERNELS

    path = tmp_path / "east.py"
    path.write_text(
        "import torch\n"
        "from scenenet.geneo import GeneoKernel, register\n"
        "@register\n"
        "class East(GeneoKernel):\n"
        "    name = 'east'\n"
        "    parameters = ()\n"
        "    def sample(self, lattice, shape):\n"
        "        kernel = torch.zeros(lattice.size)\n"
        "        kernel[:, :, -1] = 1.0\n"
        "        return kernel * (lattice.inside if lattice.inside is not None else 1.0)\n"
    )
    monkeypatch.setenv(KERNELS.variable, str(path))
    east, round_one = OneKernel("east"), OneKernel("cylinder")
    assert KernelFacts.of(east.orbit, 1.0).quarter_turn_error == 1.0
    assert measured_equivariance(east.answers, 1.0).quarter_turn > 0.1
    assert measured_equivariance(round_one.answers, 1.0).quarter_turn < 1e-5


def test_equivariance_is_what_the_certificate_of_the_same_observer_says():
    chosen = OneKernel("cylinder", {"r": 0.4})
    found = measured_equivariance(chosen.answers, 1.0)
    expected = certify(chosen.model)
    worst = max((t for t in expected.turns if t.degrees % 90), key=lambda t: t.mean_h)
    assert found.translation < 1e-5 and expected.translation_error < 1e-5
    assert (found.between, found.between_degrees) == (
        pytest.approx(worst.mean_h, rel=1e-3),
        worst.degrees,
    )
    assert found.half_voxel == pytest.approx(expected.half_voxel.mean_h, rel=1e-3)


def test_a_kernel_with_a_direction_answers_with_the_largest_of_its_orbit():
    line = OneKernel("line")
    kernel = kernel_named("line")
    facts = KernelFacts.of(line.orbit, 1.0)
    assert facts.directions == kernel.turns * len(kernel.slopes) > 1
    assert facts.quarter_turn_error < 1e-5
    assert KernelFacts.of(line.sampled()[None], 1.0).quarter_turn_error > 0.1
    index = np.flatnonzero(np.random.default_rng(3).random(9 * 30 * 30) < 0.02)
    scene = Occupancy.of_grids([index], None, (9, 30, 30))
    every = np.stack([convolve(scene, one).reshape(-1).numpy()[index] for one in line.orbit])
    assert np.allclose(line.answers(scene), every.max(axis=0), atol=1e-5)


def test_an_operator_that_knows_where_it_is_is_not_equivariant():
    found = measured_equivariance(lambda scene: scene.index % scene.shape[2] + 0.0, 1.0)
    assert found.translation > 0.05
    assert found.quarter_turn > 0.5
