"""Where a training by gradient begins (thesis 5.2.1, 5.3.4).

- ``thesis``: numbers are drawn once, a SCENE-Net's from the ranges that stand beside its kernels
  and a CNN's as torch does (``scenenet.models.scenenet``).
- ``unranged``: "not enforcing ranges" (5.3.4), every number of a SCENE-Net from N(0, 1).
- ``handcrafted``: "handcrafted values" (5.3.4), the same for every seed.
- ``informed``: the training crops choose it.

A model is dead where its observer is negative at everything that matters: ReLU then answers zero,
lets no gradient through, and training never moves (thesis 5.2.6: "only one in five trained CNNs
returns non-zero predictions"). Both ways of
``informed`` begin where towers are distinguished from the rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.convolve import convolve_at_voxels
from scenenet.convolution.observer import count_reached
from scenenet.dataset.batches import batch
from scenenet.dataset.voxels import Measurement, VoxelSample
from scenenet.geneo import kernel_named
from scenenet.metrics.score_columns import BETA
from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve
from scenenet.models.base import VoxelModel
from scenenet.models.cnn import CNN
from scenenet.models.factory import new_model
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import KernelSize, ModelSettings

MOST_VOXELS = 20_000
"""Occupied voxels that a CNN's start is worked out from, beside those of towers."""
DRAWS = 64
"""Sets of numbers that a SCENE-Net begins at the best of."""
NOISE = 0.1
"""Part of the random weights that a CNN keeps, which tells its kernels and the seeds apart."""


def starting_model(
    settings: ModelSettings, seed: int, training: Sequence[VoxelSample]
) -> VoxelModel:
    """A new model that begins as ``settings.training.init`` says."""
    init = settings.training.init
    if init == "informed":
        return informed_model(settings, seed, training)
    model = new_model(settings, seed)
    if isinstance(model, GeneoModel) and init == "unranged":
        generator = torch.Generator().manual_seed(seed)
        model.set_numbers(torch.randn(model.n_parameters(), generator=generator).numpy())
    if isinstance(model, GeneoModel) and init == "handcrafted":
        model.set_shape_parameters(handcrafted(model))
    return model


def handcrafted(model: GeneoModel) -> dict[str, float]:
    """Numbers that were set by hand, by name: the kernels' own (``ShapeParameter.handcrafted``),
    and every kernel with the same weight."""
    shapes = {
        f"{name}.{parameter.name}": parameter.handcrafted
        for name, geneo in zip(model.names, model.geneos, strict=True)
        for parameter in kernel_named(geneo).parameters
    }
    return shapes | {f"lambda.{name}": 1 / len(model.names) for name in model.names}


def informed_model(
    settings: ModelSettings, seed: int, training: Sequence[VoxelSample]
) -> VoxelModel:
    """A new model that begins where it tells the towers of ``training`` from the rest.

    A SCENE-Net is the best of ``DRAWS`` draws from its ranges, by the F0.5 at its best tau. The
    kernels of a CNN tell what is around tower voxels from what is around other occupied ones
    (``discriminant``), with the bias at which F0.5 is highest.
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


def _best_f05(
    model: VoxelModel, training: Sequence[VoxelSample], measurement: Measurement
) -> float:
    total = ThresholdCurve.empty()
    with torch.no_grad():
        kernel, bias = model.observer()
        for sample in training:
            occupancy, towers = batch([sample], measurement)
            total += ThresholdCurve(*count_reached(occupancy, kernel, bias, towers, THRESHOLDS))
    return total.best()[1].decisive


def _towards_towers(model: CNN, training: Sequence[VoxelSample], measurement: Measurement) -> CNN:
    kernel = discriminant(training, measurement, model.kernel_size)
    n = len(model.bias)
    with torch.no_grad():
        # In the size of a random start, so that steps of training mean the same to both.
        kernel *= model.weight.sum(dim=0).norm() / kernel.norm().clamp(min=1e-9)
        model.weight.mul_(NOISE).add_(kernel / n)
        kernel, _ = model.observer()
        border = _best_border(kernel, training, measurement)
        model.bias.fill_(-border / n)
    return model


def _best_border(
    kernel: Tensor, training: Sequence[VoxelSample], measurement: Measurement
) -> float:
    """The answer at the occupied voxels from which on F0.5 is highest."""
    answers, towers = [], []
    for sample in training:
        occupancy, _ = batch([sample], measurement)
        answers.append(convolve_at_voxels(occupancy, kernel.detach()[None])[0].numpy())
        towers.append(sample.tower)
    answer, tower = np.concatenate(answers), np.concatenate(towers)
    order = np.argsort(-answer, kind="stable")
    found = tower[order].cumsum()
    b2 = BETA**2
    f05 = (1 + b2) * found / (b2 * tower.sum() + np.arange(1, len(order) + 1))
    return float(answer[order[int(np.argmax(f05))]])


def discriminant(
    samples: Sequence[VoxelSample], measurement: Measurement, size: KernelSize
) -> Tensor:
    """Fisher's linear discriminant of what is around tower voxels and around other occupied ones,
    (kz, ky, kx): (C + s I)^-1 (m_tower - m_other), with s the mean variance.
    """
    every, towers = [], []
    rows = max(1, MOST_VOXELS // max(1, len(samples)))
    for sample in samples:
        # All tower voxels, and of the others evenly as many as there is room for.
        others = np.flatnonzero(~sample.tower)
        others = others[:: -(-len(others) // rows)]
        chosen = np.concatenate([np.flatnonzero(sample.tower), others])
        every.append(_patches(sample, chosen, measurement, size))
        towers.append(sample.tower[chosen])
    seen, tower = np.concatenate(every), np.concatenate(towers)
    within = np.where(tower[:, None], seen[tower].mean(axis=0), seen[~tower].mean(axis=0))
    spread = seen - within
    covariance = spread.T @ spread / len(seen)
    covariance += np.eye(len(covariance)) * (np.trace(covariance) / len(covariance))
    apart = seen[tower].mean(axis=0) - seen[~tower].mean(axis=0)
    return torch.from_numpy(np.linalg.solve(covariance, apart).astype(np.float32)).reshape(size)


def _patches(
    sample: VoxelSample, rows: np.ndarray, measurement: Measurement, size: KernelSize
) -> np.ndarray:
    """phi around occupied voxels, (R, kz * ky * kx) float32, as a kernel lies on them."""
    low = [(k - 1) // 2 for k in size]
    borders = [(a, k - 1 - a) for a, k in zip(low, size, strict=True)]
    volume = np.zeros(sample.grid.n_voxels, np.float32)
    volume[sample.index] = sample.phi(measurement)
    windows = np.lib.stride_tricks.sliding_window_view(
        np.pad(volume.reshape(sample.grid.shape), borders), size
    )
    places = np.unravel_index(sample.index[rows], sample.grid.shape)
    return windows[places].reshape(len(rows), -1)
