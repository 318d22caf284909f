"""Where a training by gradient begins, if it is to look at the data first (``init: field``).

A model is dead where its observer is negative at everything that matters: ReLU then answers zero,
lets no gradient through, and training never moves (thesis 5.2.6: "only one in five trained CNNs
returns non-zero predictions"). Both ways here begin where towers are told from the rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from scenenet.batches import batch
from scenenet.convolution import convolution_gradient
from scenenet.metrics import THRESHOLDS, ThresholdCurve
from scenenet.models import CNN, SceneNet, VoxelModel, new_model
from scenenet.observer import count_reached
from scenenet.protocol import KernelSize, Measurement, ModelSettings
from scenenet.voxels import VoxelSample

DRAWS = 64
"""Sets of numbers that a SCENE-Net begins at the best of."""
NOISE = 0.1
"""Part of the random weights that a CNN keeps, which tells its kernels and the seeds apart."""


def informed_model(
    settings: ModelSettings, seed: int, training: Sequence[VoxelSample]
) -> VoxelModel:
    """A new model that begins where it tells the towers of ``training`` from the rest.

    A SCENE-Net is the best of ``DRAWS`` draws from its ranges, by the F0.5 at its best tau. The
    kernels of a CNN are what is around tower voxels less what is around the other occupied ones,
    scaled so that its observer is 1 at the mean tower voxel and -1 at the mean other one.
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
    return total.best()[1].f05


def _towards_towers(model: CNN, training: Sequence[VoxelSample], measurement: Measurement) -> CNN:
    around_tower, around_other = mean_surroundings(training, measurement, model.kernel_size)
    difference = around_tower - around_other
    at_tower = float((difference * around_tower).sum())
    at_other = float((difference * around_other).sum())
    gain = 2 / max(at_tower - at_other, 1e-6)
    n = len(model.bias)
    with torch.no_grad():
        model.weight.mul_(NOISE).add_(gain * difference / n)
        model.bias.mul_(NOISE).add_((1 - gain * at_tower) / n)
    return model


def mean_surroundings(
    samples: Sequence[VoxelSample], measurement: Measurement, size: KernelSize
) -> tuple[Tensor, Tensor]:
    """phi around the mean tower voxel and around the mean other occupied one, (kz, ky, kx) each.

    They lie as a kernel does: the inner product with a kernel is its answer there.
    """
    sums = [torch.zeros(size), torch.zeros(size)]
    counts = [0, 0]
    for sample in samples:
        occupancy, _ = batch([sample], measurement)
        for i, chosen in enumerate((sample.tower, ~sample.tower)):
            # The gradient of a sum of answers by the kernel is the sum of what they saw.
            upstream = torch.zeros(occupancy.n_voxels)
            upstream[torch.from_numpy(occupancy.index[chosen])] = 1
            volume = upstream.reshape(len(occupancy), *occupancy.shape)
            sums[i] += convolution_gradient(occupancy, volume, size)
            counts[i] += int(chosen.sum())
    around_tower, around_other = (
        total / max(count, 1) for total, count in zip(sums, counts, strict=True)
    )
    return around_tower, around_other
