"""Sums, maxima and products of operators."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from scenenet.convolution.occupancy import Occupancy
from scenenet.interpretability.certificate import certificate
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.mixing import constant, mixed
from scenenet.models.model_file import ModelCard, read_model, write_model
from scenenet.models.settings import MetricSettings

ANSWERS = st.lists(st.floats(-3, 3, width=32), min_size=6, max_size=6)


def probability(h: torch.Tensor) -> torch.Tensor:
    return torch.relu(torch.tanh(h))


@given(ANSWERS)
def test_parts_sum_to_the_mixture(values):
    answers = torch.tensor(values).reshape(3, 2)
    np.testing.assert_array_equal(mixed(answers, "convex"), answers)
    np.testing.assert_array_equal(mixed(answers, "maximum").sum(dim=0), answers.amax(dim=0))
    product = mixed(answers, "product").sum(dim=0)
    expected = probability(answers).prod(dim=0)
    torch.testing.assert_close(probability(product), expected, atol=2e-6, rtol=1e-5)


@pytest.mark.parametrize("mixing", ["maximum", "product"])
@given(ANSWERS, ANSWERS)
def test_a_mixture_differs_by_no_more_than_its_constant(mixing, some, others):
    one, other = (torch.tensor(v).reshape(3, 2) for v in (some, others))
    bound = constant([float(d) for d in (one - other).abs().amax(dim=1)], mixing)
    a, b = (probability(mixed(each, mixing).sum(dim=0)) for each in (one, other))
    assert float((a - b).abs().max()) <= bound + 1e-5


def model(mixing: str) -> MetricSceneNet:
    metric = MetricSettings(
        mixing=mixing, numbers="searched", whole_towers=False, section_radius=0, section_above=0
    )
    generator = torch.Generator().manual_seed(0)
    found = MetricSceneNet(("blob", "cylinder"), metric, generator=generator)
    numbers = found.shape_parameters() | {"lambda.blob": 0.75, "lambda.cylinder": 0.25}
    found.set_shape_parameters(numbers)
    return found


@pytest.mark.parametrize("mixing", ["maximum", "product"])
def test_a_model_answers_with_its_mixture_and_its_file_keeps_it(mixing, tmp_path):
    rng = np.random.default_rng(0)
    index = np.flatnonzero(rng.random((12, 14, 14)) < 0.05)
    scene = Occupancy.of_grids([index], None, (12, 14, 14))
    made, plain = model(mixing), model("convex")
    plain.load_state_dict(made.state_dict())
    with torch.no_grad():
        answers = plain.responses(scene, plain.weighted_kernels().detach())
        parts = made.responder()(scene)
    pairs = probability(answers)
    expected = pairs.amax(dim=0) if mixing == "maximum" else pairs.prod(dim=0)
    torch.testing.assert_close(probability(parts.sum(dim=0)), expected, atol=1e-5, rtol=1e-4)
    assert (expected > 0.01).any()

    path = tmp_path / "m.json"
    card = ModelCard(
        name="m", codes="edp", measurement="presence", fit="metric", resolution=64,
        voxel_size=1.0, tau=0.2, target="vegetation",
    )  # fmt: skip
    write_model(path, made, card)
    again, _ = read_model(path)
    torch.testing.assert_close(again.responder()(scene), parts)

    said = {s.property: s for s in certificate(path).statements}
    assert said["equivariant under translation by whole voxels"].holds
    assert said["equivariant under quarter turns about z"].holds
    assert not said["observer: convex combination of GENEOs"].holds
    what = "model M" if mixing == "product" else "observer H"
    found = said[f"the {what} is non-expansive without scaling"]
    assert found.value is not None
    numbers = certificate(path).numbers
    assert 0 < numbers["measured"] <= numbers["l1_bound"] * (1 + 1e-5)
