"""Each number of a SCENE-Net is described in metres, by the formulas of its kernel."""

from __future__ import annotations

import math
import re
import subprocess
import sys

import pytest
import torch

from scenenet.geneo import Lattice, kernel_named
from scenenet.geneo.sentences import Reference
from scenenet.interpretability.parameter_sentences import parameters_of, sentences
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import MetricSettings

VALUES = {
    "cylinder.r": 0.9,
    "cylinder.sigma": 0.5,
    "arrow.r": 0.6,
    "arrow.sigma": 0.4,
    "arrow.r_c": 1.2,
    "arrow.beta": 0.5,
    "negative_sphere.r": 1.0,
    "negative_sphere.sigma": 0.8,
    "negative_sphere.omega": 0.1,
    "lambda.cylinder": 0.2,
    "lambda.arrow": 0.1,
    "lambda.negative_sphere": 0.7,
}


def lengths(sentence: str) -> list[float]:
    return [float(x) for x in re.findall(r"(\d+\.\d+) m\b", sentence)]


def test_parameters_in_voxels_are_converted_to_metres():
    in_voxels = {p.name: p for p in parameters_of(SceneNet(), 0.5)}
    assert in_voxels["cylinder.r"].factor == 0.5
    assert in_voxels["cylinder.sigma"].factor == 0.25
    assert in_voxels["arrow.beta"].factor == 1
    assert in_voxels["lambda.arrow"].factor == 1
    assert in_voxels["cylinder.sigma"].unit == "m^2"
    in_metres = parameters_of(MetricSceneNet(metric=MetricSettings()), 0.5)
    assert {p.factor for p in in_metres} == {1.0}
    assert [p.name for p in in_metres] == list(SceneNet().shape_parameters())


def test_every_number_has_a_sentence_that_depends_on_it():
    first = sentences(SceneNet(), VALUES)
    assert list(first) == list(SceneNet().shape_parameters())
    other = sentences(SceneNet(), {name: 0.8 * value for name, value in VALUES.items()})
    assert [name for name in first if first[name] == other[name]] == []


def test_the_cylinder_is_as_wide_as_twice_its_radius_and_a_share_of_a_tower():
    texts = sentences(SceneNet(), VALUES, Reference(tower_width=3.6))["cylinder.r"]
    assert lengths(texts) == [1.8]
    assert "50% of the mean width" in texts


def test_the_widths_for_sigma_are_where_the_shell_is_half_as_high():
    inner, outer = lengths(sentences(SceneNet(), VALUES)["cylinder.sigma"])
    r, sigma = VALUES["cylinder.r"], VALUES["cylinder.sigma"]
    for d in (inner, outer):
        height = math.exp(-((d**2 - r**2) ** 2) / (2 * sigma**2))
        assert height == pytest.approx(0.5, abs=0.07)  # lengths are written with two digits


def test_the_sphere_is_negative_beyond_the_length_given_for_omega():
    (beyond,) = lengths(sentences(SceneNet(), VALUES)["negative_sphere.omega"])
    shape = {
        name: torch.tensor(VALUES[f"negative_sphere.{name}"]) for name in ("r", "sigma", "omega")
    }
    fine = Lattice.of_extent((1, 1, 61), radius=3.0, voxel_size=0.1)
    kernel = kernel_named("negative_sphere").sample(fine, shape)[0, 0]
    far = fine.planar_squared[0, 0].sqrt() > beyond + 0.1
    assert bool((kernel[far] < 0).all())
    assert float(kernel[30 + round(10 * beyond) - 2]) > 0


def test_sentences_of_weights_give_their_rank():
    texts = sentences(SceneNet(), VALUES)
    assert texts["lambda.negative_sphere"].startswith("70.0%")
    assert "the largest weight of the 3" in texts["lambda.negative_sphere"]
    assert "the smallest weight" in texts["lambda.arrow"]


def test_a_negative_weight_and_a_sphere_without_omega_are_described():
    odd = VALUES | {"lambda.arrow": -0.2, "negative_sphere.omega": -0.1}
    texts = sentences(SceneNet(), odd)
    assert "not convex" in texts["lambda.arrow"]
    assert "nothing is subtracted" in texts["negative_sphere.omega"]


def test_repeated_kernels_are_described_by_their_own_numbers():
    model = SceneNet(["cylinder", "cylinder"])
    values = {
        "cylinder.r": 0.5,
        "cylinder.sigma": 0.5,
        "cylinder_2.r": 2.0,
        "cylinder_2.sigma": 0.5,
        "lambda.cylinder": 0.5,
        "lambda.cylinder_2": 0.5,
    }
    texts = sentences(model, values)
    assert lengths(texts["cylinder_2.r"]) == [4.0]


def test_names_of_tables_and_pictures_need_no_torch():
    """The workflow needs them for every plan."""
    asked = "import sys, scenenet.results.tables, scenenet.figures, scenenet.results.folder"
    heavy = "print([name for name in ('torch', 'matplotlib', 'numba') if name in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", f"{asked}; {heavy}"], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
