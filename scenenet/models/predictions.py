"""Probabilities of a model over whole crops, and scores at every threshold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from scenenet.convolution.coarsening import block_edge, coarsened
from scenenet.convolution.convolve import convolve_at_voxels
from scenenet.convolution.cross_section import strongest
from scenenet.convolution.observer import count_reached
from scenenet.convolution.occupancy import Occupancy
from scenenet.dataset.batches import batch
from scenenet.dataset.voxels import Measurement, VoxelSample
from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve
from scenenet.models.base import VoxelModel
from scenenet.models.metric_scenenet import MetricSceneNet

EVALUATED_AT_ONCE = 8
"""Crops that are scored together: enough to keep the cores busy, few enough to need no memory."""


def threshold_curve(
    model: VoxelModel, samples: Sequence[VoxelSample], measurement: Measurement
) -> ThresholdCurve:
    """Scores at every tau over all voxels of ``samples``, empty ones included."""
    if isinstance(model, MetricSceneNet):
        return curve_of(model, scenes_of(model, samples, measurement))
    total = ThresholdCurve.empty()
    with torch.no_grad():
        kernel, bias = model.observer()
        for start in range(0, len(samples), EVALUATED_AT_ONCE):
            occupancy, towers = batch(samples[start : start + EVALUATED_AT_ONCE], measurement)
            total += ThresholdCurve(*count_reached(occupancy, kernel, bias, towers, THRESHOLDS))
    return total


def probabilities(
    model: VoxelModel, sample: VoxelSample, measurement: Measurement
) -> tuple[np.ndarray, np.ndarray]:
    """Probability (V,) float32 and truth (V,) bool of every voxel of the sample's grid."""
    if isinstance(model, MetricSceneNet):
        (scene,) = scenes_of(model, [sample], measurement)
        with torch.no_grad():
            return sample.spread(answers(model, scene))
    occupancy, towers = batch([sample], measurement)
    with torch.no_grad():
        probability = model(occupancy).numpy().reshape(-1)
    truth = np.zeros(len(probability), bool)
    truth[towers] = True
    return probability, truth


@dataclass(frozen=True)
class Scene:
    """A crop, ready to be answered many times.

    Attributes:
        observed: its voxels, or the blocks of them that a fine grid is observed through.
        voxel_size: m, edge of these.
        section: the others in the section of each (``scenenet.convolution.cross_section``).
        row: (M,) the one that each occupied voxel of the crop lies in.
        tower: (M,) bool, the truth.
        n_voxels: all voxels of the crop, empty ones included.
    """

    observed: Occupancy
    voxel_size: float
    section: tuple[np.ndarray, np.ndarray]
    row: np.ndarray
    tower: np.ndarray
    n_voxels: int


def scenes_of(
    model: MetricSceneNet, samples: Sequence[VoxelSample], measurement: Measurement
) -> list[Scene]:
    """The crops of ``samples`` as ``model`` takes them."""
    scenes = []
    for sample in samples:
        occupancy, _ = batch([sample], measurement)
        edge = block_edge(sample.grid.voxel_size)
        observed, row = coarsened(occupancy, edge)
        size = edge * sample.grid.voxel_size
        section = model.at(size).section(observed)
        scenes.append(Scene(observed, size, section, row, sample.tower, sample.grid.n_voxels))
    return scenes


def answers(model: MetricSceneNet, scene: Scene) -> np.ndarray:
    """Probability of each occupied voxel, (M,) float32; that of the others is 0."""
    kernel, _ = model.at(scene.voxel_size).observer()
    observed = convolve_at_voxels(scene.observed, kernel.detach()[None])[0].numpy()
    spoken = observed[strongest(observed, *scene.section)]
    return np.tanh(np.maximum(spoken, 0))[scene.row]


def curve_of(model: MetricSceneNet, scenes: Sequence[Scene]) -> ThresholdCurve:
    """Scores at every tau over all voxels, empty ones included."""
    total = ThresholdCurve.empty()
    with torch.no_grad():
        for scene in scenes:
            curve = ThresholdCurve.of(answers(model, scene), scene.tower)
            curve.false[0] += scene.n_voxels - len(scene.tower)
            total += curve
    return total
