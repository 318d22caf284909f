"""Initialisation of training by gradient (thesis 5.2.1, 5.3.4).

- ``thesis``: numbers are drawn once: those of a SCENE-Net from the ranges of its kernels, those of
  a CNN as torch draws them.
- ``unranged``: "not enforcing ranges" (5.3.4), every number of a SCENE-Net from N(0, 1).
- ``handcrafted``: "handcrafted values" (5.3.4), the same for every seed.
- ``published``: the weights of the code of the thesis (``scenenet.models.published_weights``).
- ``informed``: chosen by the training crops.

A model is dead if its observer is negative at all voxels that matter: ReLU then gives zero and no
gradient, and training never moves (thesis 5.2.6: "only one in five trained CNNs returns non-zero
predictions"). An ``informed`` model starts with numbers that separate towers from the rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.convolve import convolve_at_voxels
from scenenet.convolution.observer import count_reached
from scenenet.dataset.batches import batch
from scenenet.dataset.voxels import VoxelSample
from scenenet.geneo import kernel_named
from scenenet.metrics.score_columns import BETA
from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve
from scenenet.models.base import VoxelModel
from scenenet.models.cnn import CNN
from scenenet.models.factory import new_model
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.published_weights import WEIGHTS
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import KernelSize, ModelSettings

MOST_VOXELS = 20_000
"""Occupied voxels, besides those of towers, that the start of a CNN is computed from."""
DRAWS = 64
"""Draws of which the best is the start of a SCENE-Net."""
NOISE = 0.1
"""Share of the random weights that a CNN keeps, so that its kernels and the seeds differ."""


def starting_model(
    settings: ModelSettings, seed: int, training: Sequence[VoxelSample]
) -> VoxelModel:
    """A new model, initialised by ``settings.training.init``."""
    init = settings.training.init
    if init == "informed":
        return informed_model(settings, seed, training)
    model = new_model(settings, seed)
    if isinstance(model, GeneoModel) and init == "unranged":
        generator = torch.Generator().manual_seed(seed)
        model.set_numbers(torch.randn(model.n_parameters(), generator=generator).numpy())
    if isinstance(model, GeneoModel) and init == "handcrafted":
        model.set_shape_parameters(handcrafted(model))
    if isinstance(model, GeneoModel) and init == "published":
        model.set_shape_parameters(WEIGHTS)
    return model


def handcrafted(model: GeneoModel) -> dict[str, float]:
    """Numbers set by hand, by name: the shape parameters of the kernels
    (``ShapeParameter.handcrafted``) and equal mixing weights."""
    shapes = {
        f"{name}.{parameter.name}": parameter.handcrafted
        for name, geneo in zip(model.names, model.geneos, strict=True)
        for parameter in kernel_named(geneo).parameters
    }
    return shapes | {f"lambda.{name}": 1 / len(model.names) for name in model.names}


def informed_model(
    settings: ModelSettings, seed: int, training: Sequence[VoxelSample]
) -> VoxelModel:
    """A new model that separates the towers of ``training`` from the rest at the start.

    A SCENE-Net is the best of ``DRAWS`` draws from its ranges, by the F0.5 at its best tau. The
    kernels of a CNN separate the surroundings of tower voxels from those of other occupied voxels
    (``discriminant``); its bias is the one with the highest F0.5.
    """
    first = new_model(settings, seed)
    if isinstance(first, CNN):
        return _towards_towers(first, training, settings.measurement)
    generator = torch.Generator().manual_seed(seed)
    tried = [
        SceneNet(settings.geneos, settings.kernel_size, generator=generator) for _ in range(DRAWS)
    ]
    scores = [_best_f05(model, training, settings.measurement) for model in tried]
    return tried[int(np.argmax(scores))]


def _best_f05(model: VoxelModel, training: Sequence[VoxelSample], measurement: str) -> float:
    total = ThresholdCurve.empty()
    with torch.no_grad():
        kernel, bias = model.observer()
        for sample in training:
            occupancy, towers = batch([sample], measurement)
            total += ThresholdCurve(*count_reached(occupancy, kernel, bias, towers, THRESHOLDS))
    return total.best()[1].decisive


def _towards_towers(model: CNN, training: Sequence[VoxelSample], measurement: str) -> CNN:
    kernel = discriminant(training, measurement, model.kernel_size)
    n = len(model.bias)
    with torch.no_grad():
        # With the norm of a random start, so that a training step has the same relative size.
        kernel *= model.weight.sum(dim=0).norm() / kernel.norm().clamp(min=1e-9)
        model.weight.mul_(NOISE).add_(kernel / n)
        kernel, _ = model.observer()
        level = _best_level(kernel, training, measurement)
        model.bias.fill_(-level / n)
    return model


def _best_level(kernel: Tensor, training: Sequence[VoxelSample], measurement: str) -> float:
    """The response that separates the occupied voxels with the highest F0.5."""
    answers, towers = [], []
    for sample in training:
        occupancy, _ = batch([sample], measurement)
        answers.append(convolve_at_voxels(occupancy, kernel.detach()[None])[0].numpy())
        towers.append(sample.labelled)
    answer, tower = np.concatenate(answers), np.concatenate(towers)
    order = np.argsort(-answer, kind="stable")
    found = tower[order].cumsum()
    b2 = BETA**2
    f05 = (1 + b2) * found / (b2 * tower.sum() + np.arange(1, len(order) + 1))
    return float(answer[order[int(np.argmax(f05))]])


def discriminant(samples: Sequence[VoxelSample], measurement: str, size: KernelSize) -> Tensor:
    """Fisher's linear discriminant between the surroundings of tower voxels and those of other
    occupied voxels, (kz, ky, kx): (C + s I)^-1 (m_tower - m_other), with s the mean variance.
    """
    every, towers = [], []
    rows = max(1, MOST_VOXELS // max(1, len(samples)))
    for sample in samples:
        # All tower voxels, and an even choice of the others within the limit.
        others = np.flatnonzero(~sample.labelled)
        others = others[:: -(-len(others) // rows)]
        chosen = np.concatenate([np.flatnonzero(sample.labelled), others])
        every.append(_patches(sample, chosen, measurement, size))
        towers.append(sample.labelled[chosen])
    seen, tower = np.concatenate(every), np.concatenate(towers)
    within = np.where(tower[:, None], seen[tower].mean(axis=0), seen[~tower].mean(axis=0))
    spread = seen - within
    covariance = spread.T @ spread / len(seen)
    covariance += np.eye(len(covariance)) * (np.trace(covariance) / len(covariance))
    apart = seen[tower].mean(axis=0) - seen[~tower].mean(axis=0)
    return torch.from_numpy(np.linalg.solve(covariance, apart).astype(np.float32)).reshape(size)


def _patches(
    sample: VoxelSample, rows: np.ndarray, measurement: str, size: KernelSize
) -> np.ndarray:
    """phi around occupied voxels, (R, kz * ky * kx) float32, in the alignment of a kernel."""
    low = [(k - 1) // 2 for k in size]
    borders = [(a, k - 1 - a) for a, k in zip(low, size, strict=True)]
    volume = np.zeros(sample.grid.n_voxels, np.float32)
    volume[sample.index] = sample.phi(measurement)
    windows = np.lib.stride_tricks.sliding_window_view(
        np.pad(volume.reshape(sample.grid.shape), borders), size
    )
    places = np.unravel_index(sample.index[rows], sample.grid.shape)
    return windows[places].reshape(len(rows), -1)
