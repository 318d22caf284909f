"""The CNN baseline (thesis 5.2.4.2)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from scenenet.models.base import VoxelModel
from scenenet.models.settings import KernelSize


class CNN(VoxelModel):
    """The baseline: as many free kernels as SCENE-Net has GENEOs, with bias, summed.

    Three 9x9x9 kernels have 3 * (729 + 1) = 2190 parameters.
    """

    kind = "cnn"

    def __init__(
        self,
        n_kernels: int = 3,
        kernel_size: KernelSize = (9, 9, 9),
        *,
        generator: torch.Generator | None = None,
    ) -> None:
        """Draw weights and biases from U(-1/sqrt(n), 1/sqrt(n)), like torch's Conv3d, with n the
        number of voxels of a kernel."""
        super().__init__()
        self.kernel_size = kernel_size
        bound = float(torch.tensor(kernel_size).prod()) ** -0.5
        weight = torch.rand((n_kernels, *kernel_size), generator=generator)
        bias = torch.rand(n_kernels, generator=generator)
        self.weight = nn.Parameter(bound * (2 * weight - 1))
        self.bias = nn.Parameter(bound * (2 * bias - 1))

    def observer(self) -> tuple[Tensor, Tensor]:
        return self.weight.sum(dim=0), self.bias.sum()
