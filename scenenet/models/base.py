"""What every model of voxels has in common (thesis 4.3)."""

from __future__ import annotations

from abc import abstractmethod
from typing import Self

import numpy as np
from torch import Tensor, nn

from scenenet.convolution.observer import observe
from scenenet.convolution.occupancy import Occupancy
from scenenet.models.settings import KernelSize, MetricSettings


class VoxelModel(nn.Module):
    """A model that is one linear kernel, a tanh and a ReLU (thesis 4.3).

    Attributes:
        kind: name of the architecture in model files and tables.
        kernel_size: (kz, ky, kx) in voxels.
        metric: lengths of a model in metres; None where kernels are in voxels.
    """

    kind: str
    kernel_size: KernelSize
    metric: MetricSettings | None = None

    def at(self, voxel_size: float) -> Self:
        """The model for voxels of ``voxel_size`` m, sharing its numbers; itself where its kernels
        are in voxels."""
        return self

    @property
    def reach(self) -> tuple[int, int, int]:
        """Voxels (z, y, x) to each side of a voxel that its answer depends on."""
        kz, ky, kx = self.kernel_size
        return kz // 2, ky // 2, kx // 2

    def argmax_rows(self, occupancy: Occupancy, observed: Tensor) -> np.ndarray:
        """(M,) row of the occupied voxel whose observation each one's answer is; its own unless
        the model looks at whole sections of a tower.

        Args:
            observed: (M,) H at the occupied voxels.
        """
        return np.arange(len(observed))

    @abstractmethod
    def observer(self) -> tuple[Tensor, Tensor | None]:
        """The summed kernel (kz, ky, kx) and the bias (), None for a model without."""

    def forward(self, occupancy: Occupancy) -> Tensor:
        """Probability of each voxel to hold a tower: (tanh(H(x)))_+, (B, D, H, W) in [0, 1]."""
        return observe(occupancy, *self.observer())

    def n_parameters(self) -> int:
        """Number of trained numbers."""
        return sum(p.numel() for p in self.parameters() if p.requires_grad)
