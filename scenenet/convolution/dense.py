"""The same results through torch's dense conv3d: the reference that tests compare with."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.occupancy import Occupancy


def convolve_dense(occupancy: Occupancy, kernel: Tensor) -> Tensor:
    """``convolve`` of one kernel, as torch does it on dense grids: what runs on a GPU.

    A GPU does a 9x9x9 kernel's multiply-adds on all voxels of a grid faster than it finds its way
    through a list, and without the atomic additions that would make sums differ from run to run.
    """
    volume = occupancy.dense(kernel.dtype, kernel.device)[:, None]
    kz, ky, kx = kernel.shape
    # Padded by hand, because torch warns of what padding="same" costs with even sizes.
    borders = [(k - 1) // 2 if low else k // 2 for k in (kx, ky, kz) for low in (True, False)]
    padded = torch.nn.functional.pad(volume, borders)
    return torch.nn.functional.conv3d(padded, kernel[None, None])[:, 0]


def squared_error_dense(
    prediction: Tensor, tower: np.ndarray, weights: tuple[float, float]
) -> Tensor:
    """``squared_error`` of probabilities (B, D, H, W) that are there already."""
    empty, at_tower = weights
    flat = prediction.reshape(-1)
    hits = flat[torch.from_numpy(tower).to(flat.device)]
    correction = at_tower * (hits - 1).square() - empty * hits.square()
    return empty * flat.square().sum() + correction.sum()
