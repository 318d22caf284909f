"""The GENEO loss: a weighted error and two penalties (thesis 4.5, 5.3.3)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.observer import squared_error
from scenenet.convolution.occupancy import Occupancy
from scenenet.models.base import VoxelModel
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.settings import LossSettings
from scenenet.training.cross_entropy import cross_entropy


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


ERRORS: Mapping[str, Callable[..., Tensor]] = {
    "squared": squared_error,
    "cross_entropy": cross_entropy,
}
PENALTIES: Mapping[str, Callable[[Tensor], Tensor]] = {
    "linear": lambda numbers: torch.relu(-numbers),
    "quadratic": lambda numbers: torch.relu(-numbers).square(),
}
"""h, the penalty on negative numbers (thesis Figure 4.5). The thesis first used the quadratic one
(5.3.3), whose slope vanishes just below zero; that of the linear one is rho everywhere below."""


def fidelity(
    model: VoxelModel,
    occupancy: Occupancy,
    tower: np.ndarray,
    weights: VoxelWeights,
    kind: str = "squared",
) -> Tensor:
    """L_seg = mean of f_w(y) e(M(x), y) over all voxels, empty ones included (thesis 4.5.1).

    Args:
        occupancy: the batch.
        tower: (T,) int64, ascending positions in (B, D, H, W) of the voxels whose target y is 1.
        kind: of the error e: ``squared``, (M(x) - y)^2, or ``cross_entropy`` (5.3.3).
    """
    kernel, bias = model.observer()
    error = ERRORS[kind](occupancy, kernel, bias, tower, (weights.empty, weights.tower))
    return error / occupancy.n_voxels


def negativity(model: VoxelModel, settings: LossSettings) -> Tensor:
    """rho_l sum h(lambda_i) + rho_t sum h(theta_i) (thesis Eq. 4.3).

    ``settings`` name h in ``PENALTIES``. The penalty of a model without shape parameters is 0.
    """
    if not isinstance(model, GeneoModel):
        return torch.zeros(())
    h = PENALTIES[settings.penalty]
    shapes = torch.stack([v for name in model.names for v in model.shape_of(name).values()])
    mixing = model.mixing_weights()
    return settings.rho_shape * h(shapes).sum() + settings.rho_mixing * h(mixing).sum()
