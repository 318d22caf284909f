"""The SCENE-Net of the thesis, with kernels in voxels (thesis 4.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

from scenenet.geneo import Lattice, ShapeParameter
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.settings import THESIS_GENEOS, KernelSize


class SceneNet(GeneoModel):
    """A SCENE-Net whose kernels have a fixed number of voxels and unconstrained parameters.

    Only the penalty of the loss keeps shape parameters and mixing weights positive (thesis 4.5).
    """

    def __init__(
        self,
        geneos: Sequence[str] = THESIS_GENEOS,
        kernel_size: KernelSize = (9, 9, 9),
        *,
        generator: torch.Generator | None = None,
    ) -> None:
        """Draw the parameters at random from the ranges of the kernels (thesis 5.2.1).

        Args:
            geneos: kernel names; a name may be repeated (thesis Table 5.5, F and G).
            kernel_size: (kz, ky, kx) in voxels.
            generator: source of the random numbers; torch's default if None.

        Raises:
            InputError: a kernel is unknown, or ``geneos`` is empty.
        """
        super().__init__(geneos, generator)
        self.kernel_size = kernel_size

    def _initial_shape(self, parameter: ShapeParameter, drawn: Tensor) -> Tensor:
        return parameter.low + (parameter.high - parameter.low) * drawn

    def _initial_mixing(self, drawn: Tensor) -> Tensor:
        return 2 / max(1, len(self.names) - 1) * drawn

    def shape_of(self, name: str) -> dict[str, Tensor]:
        return dict(self._stored_shape(name).items())

    def mixing_weights(self) -> Tensor:
        """lambda, (K,), sums to 1: the last is 1 minus the others (thesis 4.5)."""
        free = [self.mixing[name] for name in self.names[:-1]]
        last = torch.ones(()) - sum(free, torch.zeros(()))
        return torch.stack([*free, last])

    def kernels(self) -> Tensor:
        lattice = Lattice.of_size(self.kernel_size)
        return torch.stack(
            [self.kernel_of(name).sample(lattice, self.shape_of(name)) for name in self.names]
        )

    def orbit_of(self, name: str, azimuth: float = 0.0) -> Tensor:
        lattice = Lattice.of_size(self.kernel_size)
        return self.kernel_of(name).orbit(lattice, self.shape_of(name), azimuth)

    def unit_of(self, parameter: ShapeParameter) -> str:
        return parameter.unit

    def length_unit_m(self, voxel_size: float) -> float:
        return voxel_size

    def _assign(self, numbers: Mapping[str, float]) -> None:
        with torch.no_grad():
            for name in self.names:
                for symbol, value in self.shape_of(name).items():
                    value.fill_(numbers[f"{name}.{symbol}"])
            for name in self.names[:-1]:
                self.mixing[name].fill_(numbers[f"lambda.{name}"])

    def with_kernel_size(self, kernel_size: KernelSize) -> SceneNet:
        """The same parameters sampled at another size (thesis 5.2.7, Table 5.4)."""
        other = SceneNet(self.geneos, kernel_size)
        other.load_state_dict(self.state_dict())
        return other

    def with_kernel_sizes(self, sizes: Sequence[KernelSize]) -> list[SceneNet]:
        return [self.with_kernel_size(size) for size in sizes if size != self.kernel_size]
