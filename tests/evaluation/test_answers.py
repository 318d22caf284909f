"""Answers for a crop, for any source of probabilities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenenet.dataset.crops import Crop
from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.answers import (
    Answer,
    at_or_above_tau,
    group_places,
    points_on,
    with_rules,
)
from scenenet.evaluation.points import PointCounts
from scenenet.experiments.components.sources import LabelledCrop
from scenenet.models.model_file import write_model
from scenenet.models.predictions import probabilities
from scenenet.pointcloud.targets import Target
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings

LONE_POLES = DetectionSettings(min_conductor=0)


@pytest.fixture
def crop(scene) -> LabelledCrop:
    """Two poles 14 m apart, on the cube of a crop."""
    cloud = scene([(8.3, 15.2), (22.4, 15.7)])
    towers = np.array([[8.3, 15.2, 0, 14], [22.4, 15.7, 0, 14]])
    towers[:, :3] += cloud.xyz.min(axis=0)
    sample = voxelise(cloud, VoxelGrid.cube(cloud.xyz, 32), "crop")
    return LabelledCrop(Crop("crop", *towers[0, :2], 30.0, towers), cloud, sample)


@pytest.mark.parametrize("shift", [0.0, 0.37])
def test_the_answer_with_rules_is_that_of_predict(crop, shift, pole_finder, tmp_path):
    model, card = pole_finder
    cloud = replace(crop.cloud, xyz=crop.cloud.xyz + shift)
    grid = VoxelGrid.cube(cloud.xyz, 32)
    answer = with_rules(
        cloud, voxelise(cloud, grid, "crop"), lambda s: probabilities(model, s, card.measurement),
        card.threshold(), 1.0, LONE_POLES,
    )  # fmt: skip
    write_model(tmp_path / "model.json", model, card)
    np.save(tmp_path / "crop.npy", np.column_stack([cloud.xyz, cloud.classification]))
    files = tmp_path / "crop.npy", tmp_path / "model.json"
    with predict_survey(*files, PredictSettings(), LONE_POLES) as prediction:
        own = prediction.look_up(cloud.xyz).tower_id > 0
        places = [(tower.x, tower.y, tower.base, tower.height) for tower in prediction.towers]
    assert len(places) == 2 and own.sum() > 300
    assert answer.points == PointCounts.of(cloud, own)
    assert np.array_equal(answer.voxels, np.unique(grid.voxel_of(cloud.xyz[own])))
    assert answer.towers == pytest.approx(np.array(places), abs=1e-3)


def test_of_another_target_the_points_in_voxels_at_or_above_tau_count(crop):
    def labels(sample):
        return sample.labels().astype(np.float32), sample.labels()

    answer = points_on({"crop": crop.cloud}, labels, 0.5, Target.parse("pole=15"))(crop.sample)
    assert answer.towers is None
    poles = crop.cloud.classification == 15
    assert (answer.points.labels.tp, answer.points.labels.fn) == (poles.sum(), 0)
    np.testing.assert_array_equal(answer.voxels, np.flatnonzero(crop.sample.labels()))


def test_rules_alone_find_poles_and_not_the_tree(crop):
    def everywhere(sample):
        return sample.spread(np.ones(len(sample.index), np.float32))

    answer = with_rules(crop.cloud, crop.sample, everywhere, 0.5, 1.0, LONE_POLES)
    apart = np.hypot(*(answer.towers[:, None, :2] - crop.crop.towers[None, :, :2]).T)
    assert apart.shape == (2, 2) and (apart.min(axis=0) < 0.3).all()
    assert answer.points.labels.precision > 0.9


def test_without_rules_voxels_give_their_points_and_groups_are_towers(crop):
    def labels(sample):
        return sample.spread(np.where(sample.labelled, 0.6, 0.4).astype(np.float32))

    answer = at_or_above_tau(crop.cloud, crop.sample, labels, 0.5)
    assert np.array_equal(answer.voxels, crop.sample.labelled_index())
    assert answer.points.labels.recall == 1.0  # every labelled point is in such a voxel
    apart = np.hypot(*(answer.towers[:, None, :2] - crop.crop.towers[None, :, :2]).T)
    assert apart.shape == (2, 2) and (apart.min(axis=0) < 0.5).all()
    assert len(at_or_above_tau(crop.cloud, crop.sample, labels, 0.7).towers) == 0


def test_voxels_that_touch_at_a_corner_are_one_group():
    voxels = np.zeros((4, 4, 8), bool)
    voxels[0, 0, 0] = voxels[1, 1, 1] = voxels[2, 2, 6] = True
    grid = VoxelGrid((10.0, 20.0, 0.0), 2.0, voxels.shape)
    places = group_places(voxels, grid)
    assert places[:, :2].tolist() == [[12.0, 22.0], [23.0, 25.0]]
    assert np.isnan(places[:, 2:]).all()


def test_a_voxel_with_a_point_of_the_answer_is_tower(crop):
    answer = Answer.of_points(crop.cloud, crop.sample.grid, crop.cloud.is_tower)
    assert np.array_equal(answer.voxels, crop.sample.labelled_index())
    assert np.array_equal(answer.among(crop.sample.grid.n_voxels), crop.sample.labels())
    assert answer.towers is None and answer.match(crop.crop.towers) is None
