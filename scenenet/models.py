"""SCENE-Net and the CNN it is measured against (thesis 4.3, 5.2.4.2)."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import cast

import torch
from torch import Tensor, nn

from scenenet.convolution import Occupancy, convolve
from scenenet.errors import InputError
from scenenet.geneo import Lattice, kernel_named
from scenenet.observer import observe
from scenenet.protocol import THESIS_GENEOS, KernelSize, ModelSettings


class VoxelModel(nn.Module):
    """A model that is one linear kernel, a tanh and a ReLU (thesis 4.3).

    Attributes:
        kind: name of the architecture in model files and tables.
        kernel_size: (kz, ky, kx) in voxels.
    """

    kind: str
    kernel_size: KernelSize

    @abstractmethod
    def observer(self) -> tuple[Tensor, Tensor | None]:
        """The summed kernel (kz, ky, kx) and the bias (), None for a model without."""

    def forward(self, occupancy: Occupancy) -> Tensor:
        """Probability of each voxel to hold a tower: (tanh(H(x)))_+, (B, D, H, W) in [0, 1]."""
        return observe(occupancy, *self.observer())

    def n_parameters(self) -> int:
        """Number of trained numbers."""
        return sum(p.numel() for p in self.parameters() if p.requires_grad)


class SceneNet(VoxelModel):
    """A convex combination of GENEO kernels (thesis Eq. 4.1).

    With a cylinder, an arrow and a negative sphere it has eleven trained numbers: nine shape
    parameters and two mixing weights; the third is one minus the others.
    """

    kind = "scenenet"

    def __init__(
        self,
        geneos: Sequence[str] = THESIS_GENEOS,
        kernel_size: KernelSize = (9, 9, 9),
        *,
        generator: torch.Generator | None = None,
    ) -> None:
        """Draw the parameters at random from the ranges of the kernels (thesis 5.2.1).

        Args:
            geneos: names of kernels; a name may come more than once (thesis Table 5.5, F and G).
            kernel_size: (kz, ky, kx) in voxels.
            generator: where the random numbers come from; torch's default if None.

        Raises:
            InputError: a kernel is not known.
        """
        super().__init__()
        if not geneos:
            raise InputError("a SCENE-Net needs at least one GENEO kernel")
        self.kernel_size = kernel_size
        self.geneos = list(geneos)
        self.names = _distinct(self.geneos)
        self.shapes = nn.ModuleDict()
        for name, geneo in zip(self.names, self.geneos, strict=True):
            shape = nn.ParameterDict()
            for parameter in kernel_named(geneo).parameters:
                drawn = torch.rand((), generator=generator)
                drawn = parameter.low + (parameter.high - parameter.low) * drawn
                shape[parameter.name] = nn.Parameter(drawn)
            self.shapes[name] = shape
        self.mixing = nn.ParameterDict()
        highest = 2 / max(1, len(self.names) - 1)
        for name in self.names[:-1]:
            self.mixing[name] = nn.Parameter(highest * torch.rand((), generator=generator))

    def shape_of(self, name: str) -> dict[str, Tensor]:
        """Shape parameters of the GENEO called ``name``, by their symbol."""
        return dict(cast(nn.ParameterDict, self.shapes[name]).items())

    def mixing_weights(self) -> Tensor:
        """lambda, (K,), summing to one: the last is 1 minus the others (thesis 4.5)."""
        free = [self.mixing[name] for name in self.names[:-1]]
        last = torch.ones(()) - sum(free, torch.zeros(()))
        return torch.stack([*free, last])

    def kernels(self) -> Tensor:
        """The sampled kernels, (K, kz, ky, kx), before mixing."""
        device = next(self.parameters()).device
        lattice = Lattice.of_size(self.kernel_size, device=device)
        return torch.stack(
            [
                kernel_named(geneo).sample(lattice, self.shape_of(name))
                for name, geneo in zip(self.names, self.geneos, strict=True)
            ]
        )

    def observer(self) -> tuple[Tensor, None]:
        return torch.einsum("k,kzyx->zyx", self.mixing_weights(), self.kernels()), None

    def contributions(self, occupancy: Occupancy) -> Tensor:
        """What each GENEO adds to the observer, (K, B, D, H, W): lambda_k (g_k * x).

        Their sum over k is the observer's answer before tanh.
        """
        return convolve(occupancy, self.weighted_kernels())

    def weighted_kernels(self) -> Tensor:
        """lambda_k g_k, (K, kz, ky, kx): the kernels whose sum is the observer's."""
        return self.mixing_weights()[:, None, None, None] * self.kernels()

    def shape_parameters(self) -> dict[str, float]:
        """Every trained number and the derived last mixing weight, by a readable name."""
        numbers = {
            f"{name}.{symbol}": float(value.detach())
            for name in self.names
            for symbol, value in self.shape_of(name).items()
        }
        weights = self.mixing_weights().detach().tolist()
        return numbers | {f"lambda.{n}": w for n, w in zip(self.names, weights, strict=True)}

    def set_shape_parameters(self, numbers: Mapping[str, float]) -> None:
        """Take numbers as ``shape_parameters`` names them; the last mixing weight is derived.

        Raises:
            InputError: a number is missing or not known, or the mixing weights do not sum to 1.
        """
        expected = self.shape_parameters()
        if missing := sorted(expected.keys() - numbers.keys()):
            raise InputError(f"parameters are missing: {', '.join(missing)}")
        if unknown := sorted(numbers.keys() - expected.keys()):
            raise InputError(f"parameters are not known: {', '.join(unknown)}")
        total = sum(numbers[f"lambda.{name}"] for name in self.names)
        if abs(total - 1) > 1e-4:
            raise InputError(f"mixing weights sum to {total:.6f}, not to 1")
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
        """Draw weights and biases from U(-1/sqrt(n), 1/sqrt(n)), n voxels, as torch's Conv3d."""
        super().__init__()
        self.kernel_size = kernel_size
        bound = float(torch.tensor(kernel_size).prod()) ** -0.5
        weight = torch.rand((n_kernels, *kernel_size), generator=generator)
        bias = torch.rand(n_kernels, generator=generator)
        self.weight = nn.Parameter(bound * (2 * weight - 1))
        self.bias = nn.Parameter(bound * (2 * bias - 1))

    def observer(self) -> tuple[Tensor, Tensor]:
        return self.weight.sum(dim=0), self.bias.sum()


def new_model(settings: ModelSettings, seed: int) -> VoxelModel:
    """A model as ``settings`` say, its numbers drawn with ``seed``."""
    generator = torch.Generator().manual_seed(seed)
    if settings.kind == "cnn":
        return CNN(settings.n_kernels, settings.kernel_size, generator=generator)
    return SceneNet(settings.geneos, settings.kernel_size, generator=generator)


def _distinct(names: Sequence[str]) -> list[str]:
    """Names with a number behind the second and later of a kind: arrow, arrow_2."""
    seen: dict[str, int] = {}
    distinct = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        distinct.append(name if seen[name] == 1 else f"{name}_{seen[name]}")
    return distinct
