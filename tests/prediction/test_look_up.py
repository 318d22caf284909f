"""Predictions for points of the survey, while the prediction is open."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.detection.settings import DetectionSettings
from scenenet.models.model_file import write_model
from scenenet.pointcloud import read, write_las
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.work.point_predictions import PointLookUp
from scenenet.prediction.work.structures import Structures

POLE = (500_020.5, 4_630_031.5)
POLE_CODE = 15


@pytest.fixture(scope="module")
def opened(scene, pole_finder, tmp_path_factory):
    """The prediction of a scene with one pole, and its points."""
    folder = tmp_path_factory.mktemp("look-up")
    write_las(folder / "field.laz", scene([(20.5, 31.5)], size=(60.0, 60.0)))
    write_model(folder / "model.json", *pole_finder)
    # A pole without conductors counts as a tower.
    detection = DetectionSettings(min_conductor=0)
    arguments = (folder / "field.laz", folder / "model.json", PredictSettings(), detection)
    with predict_survey(*arguments) as prediction:
        yield prediction, read(folder / "field.laz")


def test_every_point_has_a_probability_a_tower_and_a_share_of_each_geneo(opened):
    prediction, cloud = opened
    points = prediction.look_up(cloud.xyz)
    assert points.probability.shape == points.tower_id.shape == (len(cloud),)
    assert points.shares.shape == (len(cloud), len(prediction.geneos))
    assert prediction.geneos == ("cylinder", "arrow", "negative_sphere")
    assert (points.probability.min(), points.probability.max() > 0.7) == (0, True)


def test_points_of_the_tower_have_its_number_and_the_others_none(opened):
    prediction, cloud = opened
    [tower] = prediction.towers
    numbers = prediction.look_up(cloud.xyz).tower_id
    apart = np.hypot(cloud.xyz[:, 0] - POLE[0], cloud.xyz[:, 1] - POLE[1])
    assert set(numbers) == {0, tower.id}
    assert not numbers[apart > 6].any()
    assert (numbers == tower.id).sum() == tower.points
    high = (cloud.classification == POLE_CODE) & (cloud.xyz[:, 2] > cloud.xyz[:, 2].min() + 4)
    assert (numbers[high] == tower.id).all()


def test_a_part_of_the_points_in_another_order_has_the_same_predictions(opened):
    prediction, cloud = opened
    whole = prediction.look_up(cloud.xyz)
    rows = np.random.default_rng(1).permutation(len(cloud))[:500]
    part = prediction.look_up(cloud.xyz[rows])
    np.testing.assert_array_equal(part.probability, whole.probability[rows])
    np.testing.assert_array_equal(part.tower_id, whole.tower_id[rows])
    np.testing.assert_array_equal(part.shares, whole.shares[rows])


def test_no_points_have_no_predictions(opened):
    prediction, _ = opened
    points = prediction.look_up(np.empty((0, 3)))
    assert len(points.probability) == len(points.tower_id) == 0
    assert points.shares.shape == (0, 3)


def test_points_in_the_shapes_of_two_towers_belong_to_the_first(opened):
    prediction, cloud = opened
    own = prediction.look_up(cloud.xyz).tower_id > 0
    [(number, structure)] = prediction.structures.numbered
    beside = structure.moved(-0.25, 0.0, 0.0)
    both = Structures(((1, beside), (number, structure)))
    look_up = PointLookUp(prediction.points.models, both, prediction.unit_sizes)
    numbers = look_up(cloud.xyz).tower_id[own]
    in_first = beside.contains(cloud.xyz[own])
    assert 0 < in_first.sum() < own.sum()
    # The others are in the same voxels, and in the second shape.
    assert np.array_equal(numbers, np.where(in_first, 1, number))
