"""Probabilities of a model in crops, and scores at every threshold."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from scenenet.convolution.coarsening import coarsened
from scenenet.convolution.convolve import convolve_at_voxels
from scenenet.convolution.cross_section import Section, highest
from scenenet.convolution.observer import count_reached
from scenenet.convolution.occupancy import Occupancy
from scenenet.dataset.batches import batch
from scenenet.dataset.voxels import VoxelSample
from scenenet.measurement.registry import PRESENCE
from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve
from scenenet.models.base import VoxelModel
from scenenet.models.known_answers import KnownAnswers
from scenenet.models.metric_scenenet import MetricSceneNet

EVALUATED_AT_ONCE = 8
"""Number of crops scored together: enough to keep the cores busy, with little memory."""


def threshold_curve(
    model: VoxelModel, samples: Sequence[VoxelSample], measurement: str
) -> ThresholdCurve:
    """Scores at every threshold over all voxels of ``samples``, empty ones included."""
    if isinstance(model, MetricSceneNet):
        return curve_of(model, prepare_crops(model, samples, measurement))
    total = ThresholdCurve.empty()
    if not model.linear:
        for sample in samples:
            total += ThresholdCurve.of(*probabilities(model, sample, measurement))
        return total
    with torch.no_grad():
        kernel, bias = model.observer()
        for start in range(0, len(samples), EVALUATED_AT_ONCE):
            occupancy, towers = batch(samples[start : start + EVALUATED_AT_ONCE], measurement)
            total += ThresholdCurve(*count_reached(occupancy, kernel, bias, towers, THRESHOLDS))
    return total


def probabilities(
    model: VoxelModel, sample: VoxelSample, measurement: str
) -> tuple[np.ndarray, np.ndarray]:
    """Probability (V,) float32 and labels (V,) bool of every voxel of the sample's grid."""
    if isinstance(model, MetricSceneNet):
        (crop,) = prepare_crops(model, [sample], measurement)
        with torch.no_grad():
            return sample.spread(Answers(model)(crop))
    occupancy, towers = batch([sample], measurement)
    with torch.no_grad():
        probability = model(occupancy).numpy().reshape(-1)
    truth = np.zeros(len(probability), bool)
    truth[towers] = True
    return probability, truth


def volumes(model: VoxelModel, occupancy: Occupancy, voxel_size: float) -> np.ndarray:
    """Probability of every voxel of grids in voxels of ``voxel_size`` m, (B, D, H, W) float32."""
    with torch.no_grad():
        if not isinstance(model, MetricSceneNet):
            return model(occupancy).numpy()
        observed, row = coarsened(occupancy, model.block_edge(voxel_size))
        blocks = model.at(model.observed_size(voxel_size))(observed).numpy().reshape(-1)
    volume = np.zeros((len(occupancy), *occupancy.shape), np.float32)
    volume.reshape(-1)[occupancy.flat()] = blocks[observed.flat()[row]]
    return volume


@dataclass(frozen=True)
class PreparedCrop:
    """A crop with everything that does not depend on the parameters of a SCENE-Net in metres, for
    repeated predictions.

    Attributes:
        observed: its voxels, or blocks of voxels if its grid is fine.
        voxel_size: m, edge of these voxels or blocks.
        section: the cross-section of each of them (``scenenet.convolution.cross_section``); None
            for a model that is not linear.
        row: (M,) row in ``observed`` of each occupied voxel of the crop.
        tower: (M,) bool, which occupied voxels are labelled tower.
        n_voxels: number of voxels of the crop, empty ones included.
    """

    observed: Occupancy
    voxel_size: float
    section: Section | None
    row: np.ndarray
    tower: np.ndarray
    n_voxels: int


def prepare_crops(
    model: MetricSceneNet, samples: Sequence[VoxelSample], measurement: str
) -> list[PreparedCrop]:
    """Prepare ``samples`` for repeated predictions by ``model``."""
    crops = []
    for sample in samples:
        occupancy, _ = batch([sample], PRESENCE)
        edge = model.block_edge(sample.grid.voxel_size)
        observed, row = coarsened(occupancy, edge)
        size = edge * sample.grid.voxel_size
        if measurement != PRESENCE:
            # Of the blocks, as a survey is measured in voxels of their size.
            zyx = np.stack(np.unravel_index(observed.index, observed.shape), axis=1)
            phi = sample.measures().in_blocks(row, zyx, size).phi(measurement)
            observed = replace(observed, values=phi)
        section = model.at(size).section(observed) if model.linear else None
        crops.append(
            PreparedCrop(observed, size, section, row, sample.labelled, sample.grid.n_voxels)
        )
    return crops


class Answers:
    """The probabilities of a model with its present numbers, whose kernels are sampled once for
    each size of voxels."""

    def __init__(self, model: MetricSceneNet, known: KnownAnswers | None = None) -> None:
        """Take a model as it is.

        Args:
            known: what was computed for the same crops with other mixing weights.
        """
        self._model, self._known = model, known
        self._responders: dict[float, Callable[[Occupancy], torch.Tensor]] = {}
        self._kernels: dict[float, torch.Tensor] = {}

    def __call__(self, crop: PreparedCrop) -> np.ndarray:
        """Probability of each occupied voxel, (M,) float32; empty voxels have probability 0."""
        size, section = crop.voxel_size, crop.section
        if section is None:
            if size not in self._responders:
                self._responders[size] = self._model.at(size).responder(self._known)
            response = self._responders[size](crop.observed).sum(dim=0).numpy()
        else:
            if size not in self._kernels:
                self._kernels[size] = self._model.at(size).observer()[0].detach()[None]
            observed = convolve_at_voxels(crop.observed, self._kernels[size], section.at)[0].numpy()
            response = highest(observed, section.starts, section.rows)
        return np.tanh(np.maximum(response, 0))[crop.row]


def curve_of(
    model: MetricSceneNet, crops: Sequence[PreparedCrop], known: KnownAnswers | None = None
) -> ThresholdCurve:
    """Scores at every threshold over all voxels, empty ones included.

    Args:
        known: what was computed for the same crops with other mixing weights.
    """
    return sum(crop_curves(model, crops, known), ThresholdCurve.empty())


def crop_curves(
    model: MetricSceneNet, crops: Sequence[PreparedCrop], known: KnownAnswers | None = None
) -> Iterator[ThresholdCurve]:
    """``curve_of`` each crop."""
    with torch.no_grad():
        probabilities_of = Answers(model, known)
        for crop in crops:
            curve = ThresholdCurve.of(probabilities_of(crop), crop.tower)
            curve.false[0] += crop.n_voxels - len(crop.tower)
            yield curve
