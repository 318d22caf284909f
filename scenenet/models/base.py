"""The base of all voxel models (thesis 4.3)."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar, Self

from torch import Tensor, nn

from scenenet.convolution.convolve import convolve_at_voxels
from scenenet.convolution.observer import observe
from scenenet.convolution.occupancy import Occupancy
from scenenet.core.errors import InputError
from scenenet.metrics.threshold_curve import ThresholdCurve
from scenenet.models.known_answers import KnownAnswers
from scenenet.models.settings import KernelSize


class VoxelModel(nn.Module):
    """A model that is one linear kernel, a tanh and a ReLU (thesis 4.3).

    Attributes:
        kind: name of the architecture in model files and tables.
        units: ``voxel`` or ``m``, the unit of lengths of the kernels.
        tau_from_training: whether tau is chosen on the training crops as well as on validation.
        kernel_size: (kz, ky, kx) in voxels.
        voxel_size: m, edge of the voxels that the kernels are sampled at; None where they are
            defined in voxels.
    """

    kind: ClassVar[str]
    units: ClassVar[str] = "voxel"
    tau_from_training: ClassVar[bool] = False
    kernel_size: KernelSize
    voxel_size: float | None = None

    def at(self, voxel_size: float) -> Self:
        """The model sampled at voxels of ``voxel_size`` m, sharing the trained numbers; the model
        itself if its kernels are in voxels."""
        return self

    def observed_size(self, voxel_size: float) -> float:
        """Edge in m of the voxels, or blocks of voxels, in which the model observes a grid of
        ``voxel_size`` m."""
        return voxel_size

    def block_edge(self, voxel_size: float) -> int:
        """Voxels per edge of these blocks."""
        return 1

    @property
    def whole_towers(self) -> bool:
        """Whether the model predicts whole towers instead of the voxels at or above tau."""
        return False

    def best_tau(self, curve: ThresholdCurve) -> float:
        """The threshold tau to use after tuning on crops with this ``curve``."""
        return curve.best()[0]

    def with_kernel_size(self, kernel_size: KernelSize) -> Self:
        """The same parameters sampled at another size (thesis 5.2.7).

        Raises:
            InputError: the model only has the size it was trained with.
        """
        raise InputError(f"a {self.kind} only has the kernel size it was trained with")

    def with_kernel_sizes(self, sizes: Sequence[KernelSize]) -> list[Self]:
        """The model at each of ``sizes`` other than its own; none if it only has one size."""
        return []

    @property
    def reach(self) -> tuple[int, int, int]:
        """Receptive field: voxels (z, y, x) to each side of a voxel that influence it."""
        kz, ky, kx = self.kernel_size
        return kz // 2, ky // 2, kx // 2

    def responses(self, occupancy: Occupancy, kernels: Tensor) -> Tensor:
        """(K, M) responses of ``kernels`` (K, kz, ky, kx), whose sum is the observer's kernel, at
        the voxel whose sum each occupied voxel takes: at itself unless the model uses
        cross-sections."""
        return convolve_at_voxels(occupancy, kernels)

    @property
    def linear(self) -> bool:
        """Whether its response before tanh is that of one kernel, which ``observer`` gives."""
        return True

    def responder(self, known: KnownAnswers | None = None) -> Callable[[Occupancy], Tensor]:
        """A function from grids to the parts (K, M) of H at their occupied voxels, whose sum over K
        is H; no gradient. The kernels are sampled once, for all grids.

        Args:
            known: what earlier responders of this model computed; for grids that stay in memory.
        """
        kernel, bias = self.observer()

        def parts(occupancy: Occupancy) -> Tensor:
            found = self.responses(occupancy, kernel.detach()[None])
            return found if bias is None else found + bias.detach()

        return parts

    @abstractmethod
    def observer(self) -> tuple[Tensor, Tensor | None]:
        """The summed kernel (kz, ky, kx) and the bias (), None for a model without bias.

        Raises:
            NotImplementedError: the model is not linear.
        """

    def forward(self, occupancy: Occupancy) -> Tensor:
        """Probability that each voxel is part of a tower, (tanh H)_+, (B, D, H, W) in [0, 1]."""
        return observe(occupancy, *self.observer())

    def n_parameters(self) -> int:
        """Number of trained numbers."""
        return sum(p.numel() for p in self.parameters() if p.requires_grad)
