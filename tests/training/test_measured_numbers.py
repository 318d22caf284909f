"""A SCENE-Net in metres whose radius and reach are measured at the labelled towers."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from fixtures.scenes import model_card

from scenenet.cli.inputs import Failures
from scenenet.cli.labelled_files import read_labelled
from scenenet.core.errors import InputError
from scenenet.dataset.tower_shapes import TowerShape
from scenenet.dataset.voxels import VoxelSettings
from scenenet.models.evidence import Evidence
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.model_file import read_model, write_model
from scenenet.models.settings import MetricSettings, ModelSettings, SearchSettings
from scenenet.synthetic import SyntheticSettings, make_survey
from scenenet.training.determination import _changed, evidence
from scenenet.training.measured_numbers import Measured, measure
from scenenet.training.train import fit

LENGTHS = MetricSettings(radius=2.0, above=3.0, below=3.0)
SHAPE = TowerShape(half_width=0.4, spread=0.1, reach=1.2, reach_spread=0.9)
CARD = model_card(fit="cube", voxel_size=0.9, tau=0.5)
MEASURED = {
    "cylinder.r": 0.4, "cylinder.sigma": 0.1, "arrow.r": 0.4, "arrow.sigma": 0.9, "arrow.r_c": 1.2,
}  # fmt: skip


def net(radius: float = 0.4, reach: float = 1.2, sigma: float = 0.1, **changes) -> MetricSceneNet:
    model = MetricSceneNet(metric=LENGTHS, generator=torch.Generator().manual_seed(0), **changes)
    lengths = {"cylinder.r": radius, "cylinder.sigma": sigma, "arrow.r": radius, "arrow.r_c": reach}
    model.set_shape_parameters(model.shape_parameters() | lengths | {"arrow.sigma": 1.0})
    return model


def settings(**changes) -> ModelSettings:
    search = SearchSettings(searches=1, trial=1, starts=8, population=6, generations=4)
    return ModelSettings(
        name="m", kind="scenenet", protocol="operational", metric=LENGTHS, search=search, **changes
    )


@pytest.fixture(scope="module")
def crops(pole_crops):
    """Three crops with a pole of known shape each."""
    return [replace(crop, shape=SHAPE) for crop in pole_crops()[:3]]


@pytest.mark.parametrize(("width", "reach"), [(0.3, 1.0), (1.0, 3.0)])
def test_radius_and_reach_of_a_model_follow_those_of_the_towers(tmp_path, width, reach):
    """A synthetic line with the labels of annotators, more than half of them wrong."""
    kinds = {"tubular": 1.0} if width < 0.5 else {"lattice_pole": 1.0}
    line = SyntheticSettings(
        towers=4, seed=12, body_width=width, arm_reach=reach, kinds=kinds, density=30.0, section=0
    )
    make_survey(line, tmp_path / "line.laz", workers=1)
    files = read_labelled([tmp_path / "line.laz"], "edp", VoxelSettings(), Failures(), tmp_path)
    dataset = files.dataset
    found = measure(net(), dataset.samples)
    assert found["cylinder.r"].value == pytest.approx(width / 2, rel=0.3)
    assert found["arrow.r_c"].value == pytest.approx(reach, rel=0.3)
    assert found["arrow.r"] == found["cylinder.r"]


def test_a_measured_number_is_the_median_over_the_towers(crops):
    widths = (0.3, 0.4, 0.5)
    shapes = [replace(SHAPE, half_width=w, reach=None, reach_spread=None) for w in widths]
    samples = [replace(s, shape=shape) for s, shape in zip(crops, shapes, strict=True)]
    found = measure(net(), samples)
    assert found.keys() == {"cylinder.r", "cylinder.sigma", "arrow.r"}  # no tower shows a reach
    assert found["cylinder.r"].value == pytest.approx(0.4)
    error = 1.2533 * 1.4826 * 0.1 / np.sqrt(3)
    assert found["cylinder.r"].high == pytest.approx(0.4 + 2 * error)
    # Two towers do not show how far a median may be wrong.
    assert measure(net(), samples[:2])["cylinder.r"] == Measured(pytest.approx(0.35), 0.05, 4.0)
    assert measure(net(), [replace(s, shape=None) for s in samples]) == {}


def test_the_search_leaves_measured_and_fixed_numbers_alone(crops, tmp_path):
    model, history = fit(crops, [], settings(), 0)
    numbers = model.shape_parameters()
    for name, value in (MEASURED | {"arrow.beta": 1.0}).items():
        assert numbers[name] == pytest.approx(value, rel=1e-4)
        assert history[name].nunique() == 1
    assert history["negative_sphere.omega"].nunique() > 1
    assert history["loss"].iloc[-1] < 0.5
    sources = {name: said.source for name, said in model.evidence.items()}
    assert sources == dict.fromkeys(numbers, "score") | dict.fromkeys(MEASURED, "points") | {
        "arrow.beta": "fixed"
    }
    write_model(tmp_path / "m.json", model, CARD)
    again, _ = read_model(tmp_path / "m.json")
    assert again.evidence == model.evidence
    assert again.metric.numbers == "measured"
    torch.testing.assert_close(again.observer()[0], model.at(0.9).observer()[0])
    # A model that is only scored has the same numbers, and nothing is said about them.
    scored, _ = fit(crops, [], settings(), 0, with_evidence=False)
    assert scored.shape_parameters() == pytest.approx(numbers, rel=1e-6)  # weights are set again
    assert scored.evidence == {}


def test_three_numbers_do_without_the_head_and_the_sphere(crops):
    """With the surroundings in place of both, only one mixing weight is searched."""
    model, history = fit(crops, [], settings(geneos=["cylinder", "surroundings"]), 0)
    assert model.n_parameters() == 3
    searched = {name for name, said in model.evidence.items() if said.source == "score"}
    assert searched == {"lambda.cylinder", "lambda.surroundings"}
    assert history["loss"].iloc[-1] < 0.5


def test_one_kernel_has_nothing_to_search(crops):
    model, _ = fit(crops, [], settings(geneos=["cylinder"]), 0)
    assert model.shape_parameters()["cylinder.r"] == pytest.approx(0.4)


def test_a_number_that_changes_no_score_is_not_determined():
    model = net()
    omega = model.shape_parameters()["negative_sphere.omega"]

    def score() -> float:
        """The score depends on omega only, and falls fast on both sides."""
        return 1 - abs(np.log(model.shape_parameters()["negative_sphere.omega"] / omega))

    said = evidence(model, {"cylinder.r": Measured(0.4, 0.39, 0.41)}, score)
    assert model.shape_parameters()["negative_sphere.omega"] == pytest.approx(omega)
    assert said["negative_sphere.omega"].determined
    assert not said["negative_sphere.r"].determined
    assert said["negative_sphere.r"].low == pytest.approx(0.1)
    assert said["negative_sphere.r"].high == pytest.approx(1.5)
    assert not said["lambda.arrow"].determined
    assert said["cylinder.r"].determined
    assert not said["arrow.beta"].determined


@pytest.mark.parametrize(
    ("value", "between", "determined"),
    [
        (1.0, (0.8, 1.2), True),
        (1.0, (0.6, 1.2), False),
        (1.0, (0.8, 1.4), False),
        (0.1, (0.1, 0.1), False),
        (3.99, (3.9, 4.0), False),
    ],
)
def test_a_number_is_determined_within_30_percent_and_off_its_bounds(value, between, determined):
    said = Evidence.of("points", value, between, (0.1, 4.0))
    assert said.determined is determined
    assert said.at_bound is (value != 1.0)


def test_a_kernel_has_its_radius_although_its_voxels_are_wider():
    thin, wide = net(0.15, sigma=0.01).kernels()[0], net(2.0, sigma=0.5).kernels()[0]
    middle = thin[thin.shape[0] // 2]
    axis = tuple(side // 2 for side in middle.shape)
    assert np.unravel_index(int(middle.argmax()), middle.shape) == axis
    assert (middle > 0).sum() == 1  # a voxel holds the whole body
    middle = wide[wide.shape[0] // 2]
    away = np.hypot(*(np.indices(middle.shape) - middle.shape[0] // 2))
    assert away[np.unravel_index(int(middle.argmax()), middle.shape)] == pytest.approx(2.0, abs=0.3)
    assert middle[axis] < 0
    assert net(0.15).kernels()[:2].sum(dim=(2, 3)).abs().max() < 1e-5


def test_the_head_is_no_second_body():
    """It has nothing below its base and nothing within the body, so that data can tell both."""
    body, head = net(1.0, 4.0, 0.3).kernels()[:2]
    assert (head[: head.shape[0] // 2] == 0).all()
    together = torch.nn.functional.cosine_similarity(body.flatten(), head.flatten(), dim=0)
    assert together < 0.1
    before = MetricSceneNet(
        metric=MetricSettings(numbers="searched"), generator=torch.Generator().manual_seed(0)
    )
    before.set_shape_parameters(
        before.shape_parameters()
        | {f"{name}.r": 0.15 for name in ("cylinder", "arrow")}
        | {f"{name}.sigma": 0.2 for name in ("cylinder", "arrow")}
    )
    body, arrow = before.kernels()[:2]
    assert torch.nn.functional.cosine_similarity(body.flatten(), arrow.flatten(), dim=0) > 0.7


def test_kernels_and_cross_sections_follow_the_towers():
    small, large = net(0.15, 1.0), net(2.0, 8.0)
    assert small.section_radius == 2.1
    assert large.section_radius == pytest.approx(2**0.5 * 2.0 + 0.5)
    assert small.kernel_size == (7, 5, 5)
    assert large.kernel_size == (7, 19, 19)
    assert large.at(0.5).kernel_size == (13, 37, 37)


def test_a_file_from_before_numbers_were_measured_reads_back(tmp_path):
    """It has format version 3, no setting ``numbers`` and no evidence."""
    lengths = LENGTHS.model_copy(update={"numbers": "searched"})
    model = MetricSceneNet(metric=lengths, generator=torch.Generator().manual_seed(5))
    write_model(tmp_path / "m.json", model, CARD)
    written = json.loads((tmp_path / "m.json").read_text())
    assert written["format_version"] == 4
    assert written["metric"].pop("numbers") == "searched"
    (tmp_path / "old.json").write_text(json.dumps(written | {"format_version": 3}))
    again, _ = read_model(tmp_path / "old.json")
    assert again.evidence == {}
    torch.testing.assert_close(again.observer()[0], model.at(0.9).observer()[0])
    (tmp_path / "old.json").write_text(json.dumps(written | {"format_version": 6}))
    with pytest.raises(InputError, match="model format 6"):
        read_model(tmp_path / "old.json")


@pytest.mark.parametrize("weight", [1.0, 0.9999999, 0.5])
def test_changed_weights_still_sum_to_one(weight):
    """A search may leave all others without weight; rounding leaves them a little."""
    values = {"a.r": 1.0, "lambda.a": weight, "lambda.b": (1 - weight) / 4, "lambda.c": 1e-9}
    values["lambda.c"] += 1 - sum(v for n, v in values.items() if n.startswith("lambda."))
    changed = _changed(values, "lambda.a", 0.25)
    assert changed["lambda.a"] == 0.25 and changed["a.r"] == 1.0
    assert sum(v for n, v in changed.items() if n != "a.r") == pytest.approx(1)
