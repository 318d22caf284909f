"""Sources of probabilities, and answers that need none."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenenet.baselines.shape_priors import cut_out, height_above_ground
from scenenet.convolution.coarsening import block_edge
from scenenet.dataset.crops import Crop
from scenenet.dataset.voxels import VoxelSample, median_voxel_size
from scenenet.evaluation.answers import Answer, Predict
from scenenet.experiments.components.settings import (
    HIGH,
    HIGH_M,
    NOTHING,
    PUBLISHED,
    RANDOM,
    RULES_ALONE,
    SHAPE_PRIORS,
)
from scenenet.experiments.label_noise.settings import LABELS
from scenenet.experiments.train_and_tune import train_and_tune
from scenenet.models.base import VoxelModel
from scenenet.models.factory import new_model
from scenenet.models.model_file import read_model
from scenenet.models.predictions import probabilities
from scenenet.models.published_weights import published_scenenet
from scenenet.models.settings import BOOSTED_TREES, ModelSettings
from scenenet.pointcloud import PointCloud
from scenenet.training.tuning import tuned_tau


@dataclass(frozen=True)
class LabelledCrop:
    """A crop as points and as voxels.

    Attributes:
        crop: its towers.
        cloud: its points.
        sample: its voxels, on the grid of the data set.
    """

    crop: Crop
    cloud: PointCloud
    sample: VoxelSample


@dataclass(frozen=True)
class Source:
    """Where probabilities come from.

    Attributes:
        name: in tables.
        seed: of the training or of the draw; 0 where there is nothing to draw.
        predict: gives the probabilities of a sample.
        tau: threshold.
        voxel_size: m, of the voxels in which a survey is predicted.
        parameters: number of trained or published numbers.
        seconds: duration of training and tuning; None where that happened elsewhere.
    """

    name: str
    seed: int
    predict: Predict
    tau: float
    voxel_size: float
    parameters: int
    seconds: float | None = None


@dataclass(frozen=True)
class Known:
    """The crops that may be learnt from.

    Attributes:
        training: to train on.
        validation: to choose tau on; if there are none, tau is chosen on the training crops.
    """

    training: Sequence[VoxelSample]
    validation: Sequence[VoxelSample]

    @property
    def voxel_size(self) -> float:
        """m, as in the card of a model."""
        return median_voxel_size(self.training)


def trained(settings: ModelSettings | None, known: Known, seed: int) -> Source:
    """A model that is trained and tuned here; None for the boosted trees."""
    tuned = train_and_tune(settings, known.training, known.validation, seed)
    name = BOOSTED_TREES if settings is None else settings.name
    return Source(
        name, seed, tuned.predict, tuned.tau, tuned.voxel_size, tuned.parameters, tuned.seconds
    )


def from_file(path: str | Path, seed: int) -> Source:
    """A tuned model, as it is used.

    Raises:
        InputError: the file cannot be read, or the model has no tau.
    """
    model, card = read_model(path)
    size = model.observed_size(card.voxel_size)
    predict = _predict(model, card.measurement)
    return Source(card.name, seed, predict, card.threshold(), size, model.n_parameters())


def untrained(settings: ModelSettings, known: Known, seeds: Sequence[int]) -> list[Source]:
    """Rules alone, the published weights, and a model of random parameters from each seed.

    Args:
        settings: of the random models.
    """
    size = known.voxel_size
    everywhere = Source(RULES_ALONE, 0, _everywhere, 0.5, size * block_edge(size), 0)
    published = _tuned(PUBLISHED, 0, published_scenenet(), "presence", known)
    drawn = [
        _tuned(RANDOM, seed, new_model(settings, seed), settings.measurement, known)
        for seed in seeds
    ]
    return [everywhere, published, *drawn]


def _tuned(name: str, seed: int, model: VoxelModel, measurement: str, known: Known) -> Source:
    """A model as it is, with tau chosen as for a trained one."""
    others = known.training if known.validation else ()
    tau, _ = tuned_tau(model, known.validation or known.training, others, measurement)
    size = model.observed_size(known.voxel_size)
    return Source(name, seed, _predict(model, measurement), tau, size, model.n_parameters())


def _predict(model: VoxelModel, measurement: str) -> Predict:
    return lambda sample: probabilities(model, sample, measurement)


def _everywhere(sample: VoxelSample) -> tuple[np.ndarray, np.ndarray]:
    """Every occupied voxel is certainly tower."""
    return sample.spread(np.ones(len(sample.index), np.float32))


def _answer(crop: LabelledCrop, in_tower: np.ndarray, towers: np.ndarray | None = None) -> Answer:
    return Answer.of_points(crop.cloud, crop.sample.grid, in_tower, towers)


def _nothing(crop: LabelledCrop) -> Answer:
    return _answer(crop, np.zeros(len(crop.cloud), bool), np.empty((0, 4)))


def _high(crop: LabelledCrop) -> Answer:
    return _answer(crop, height_above_ground(crop.cloud.xyz) > HIGH_M)


def _labels(crop: LabelledCrop) -> Answer:
    return _answer(crop, crop.cloud.is_tower, crop.crop.towers)


def _shape_priors(crop: LabelledCrop) -> Answer:
    cut = cut_out(crop.cloud.xyz)
    return _answer(crop, cut.points, cut.places)


FIXED: Mapping[str, Callable[[LabelledCrop], Answer]] = {
    NOTHING: _nothing,
    HIGH: _high,
    LABELS: _labels,
    SHAPE_PRIORS: _shape_priors,
}
"""Answers without probabilities by their names."""
