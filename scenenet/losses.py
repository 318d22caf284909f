"""The GENEO loss: a weighted squared error and two penalties (thesis 4.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from scenenet.convolution import Occupancy
from scenenet.models import SceneNet, VoxelModel
from scenenet.observer import squared_error
from scenenet.protocol import LossSettings


@dataclass(frozen=True)
class VoxelWeights:
    """f_w for the two target values (thesis 4.5.1)."""

    empty: float
    tower: float

    @classmethod
    def of_counts(cls, n_tower: int, n_voxels: int, alpha: float, epsilon: float) -> VoxelWeights:
        """f_w = f'' / mean(f''), f'' = max(1 - alpha p(y), epsilon), p the share of target y.

        Args:
            n_tower: voxels of the training set whose target is 1.
            n_voxels: all voxels of the training set, empty ones included.

        Returns:
            weights whose mean over the training set is 1.
        """
        share = n_tower / n_voxels
        empty = max(1 - alpha * (1 - share), epsilon)
        tower = max(1 - alpha * share, epsilon)
        mean = (1 - share) * empty + share * tower
        return cls(empty / mean, tower / mean)


def fidelity(
    model: VoxelModel, occupancy: Occupancy, tower: np.ndarray, weights: VoxelWeights
) -> Tensor:
    """L_seg = mean of f_w(y) (M(x) - y)^2 over all voxels, empty ones included (thesis 4.5.1).

    Args:
        occupancy: the batch.
        tower: (T,) int64, ascending positions in (B, D, H, W) of the voxels whose target y is 1.
    """
    kernel, bias = model.observer()
    error = squared_error(occupancy, kernel, bias, tower, (weights.empty, weights.tower))
    return error / occupancy.n_voxels


def negativity(model: VoxelModel, settings: LossSettings) -> Tensor:
    """rho_l sum h(lambda_i) + rho_t sum h(theta_i), h(x) = (-x)_+ (thesis Eq. 4.3).

    A model without shape parameters has nothing to penalise.
    """
    if not isinstance(model, SceneNet):
        return torch.zeros(())
    shapes = torch.stack([v for name in model.names for v in model.shape_of(name).values()])
    mixing = model.mixing_weights()
    return (
        settings.rho_shape * torch.relu(-shapes).sum()
        + settings.rho_mixing * torch.relu(-mixing).sum()
    )
