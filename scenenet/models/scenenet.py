"""SCENE-Net and the CNN it is measured against (thesis 4.3, 5.2.4.2)."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from typing import Self, cast

import numpy as np
import torch
from torch import Tensor, nn

from scenenet.convolution.convolve import convolve, convolve_at_voxels
from scenenet.convolution.cross_section import neighbours, section_offsets, strongest, whole_voxels
from scenenet.convolution.occupancy import Occupancy
from scenenet.core.errors import InputError
from scenenet.geneo import Lattice, ShapeParameter, kernel_named
from scenenet.models.base import VoxelModel
from scenenet.models.settings import THESIS_GENEOS, KernelSize, MetricSettings

COLUMN_M = 2.0
"""Occupied metres of a tower's axis that the observer of a SCENE-Net in metres answers 1 to. It
sets the scale of H alone: the twelve metres that the kernels reach then make no more than 6, where
float32 still tells probabilities apart."""


class SceneNet(VoxelModel):
    """A convex combination of GENEO kernels (thesis Eq. 4.1).

    With a cylinder, an arrow and a negative sphere it has eleven trained numbers: nine shape
    parameters and two mixing weights; the third is one minus the others.

    Its kernels are in voxels as in the thesis, or, with ``metric``, in metres. Then

    - they are sampled at the voxel size of the grid (``at``), and H is weighted by it, so that a
      column of a tower that is occupied over so many metres has the same answer on every grid;
    - the parameters are kept as logits between their bounds, and the mixing weights as logits of
      a softmax: whatever the numbers are, they are positive and convex;
    - an empty voxel is no tower, and an occupied one is as much tower as the strongest in its
      section of a tower (``scenenet.convolution.cross_section``).
    """

    kind = "scenenet"

    def __init__(
        self,
        geneos: Sequence[str] = THESIS_GENEOS,
        kernel_size: KernelSize = (9, 9, 9),
        *,
        metric: MetricSettings | None = None,
        generator: torch.Generator | None = None,
    ) -> None:
        """Draw the parameters at random from the ranges of the kernels (thesis 5.2.1).

        Args:
            geneos: names of kernels; a name may come more than once (thesis Table 5.5, F and G).
            kernel_size: (kz, ky, kx) in voxels; follows from the lengths with ``metric``.
            metric: lengths, for a model in metres; it begins at a voxel size of 1 m.
            generator: where the random numbers come from; torch's default if None.

        Raises:
            InputError: a kernel is not known.
        """
        super().__init__()
        if not geneos:
            raise InputError("a SCENE-Net needs at least one GENEO kernel")
        self.kernel_size = kernel_size
        self.metric = metric
        self.voxel_size = 1.0
        self.geneos = list(geneos)
        self.names = _distinct(self.geneos)
        self.shapes = nn.ModuleDict()
        for name, geneo in zip(self.names, self.geneos, strict=True):
            shape = nn.ParameterDict()
            for parameter in kernel_named(geneo).parameters:
                drawn = torch.rand((), generator=generator)
                if metric is None:
                    drawn = parameter.low + (parameter.high - parameter.low) * drawn
                else:
                    drawn = torch.logit(0.03 + 0.94 * drawn)
                shape[parameter.name] = nn.Parameter(drawn)
            self.shapes[name] = shape
        self.mixing = nn.ParameterDict()
        highest = 2 / max(1, len(self.names) - 1)
        for name in self.names[:-1]:
            drawn = torch.rand((), generator=generator)
            drawn = highest * drawn if metric is None else 6 * drawn - 3
            self.mixing[name] = nn.Parameter(drawn)
        if metric is not None:
            self._discretise(1.0)

    def at(self, voxel_size: float) -> Self:
        if self.metric is None or voxel_size == self.voxel_size:
            return self
        other = copy.copy(self)  # shallow: the numbers are the same objects
        other._discretise(voxel_size)
        return other

    def _discretise(self, voxel_size: float) -> None:
        assert self.metric is not None
        up, down = (whole_voxels(m, voxel_size) for m in (self.metric.above, self.metric.below))
        wide = 2 * whole_voxels(self.metric.radius, voxel_size) + 1
        # Centred on the voxel that it answers for, so as tall as the longer side; the other ends
        # earlier (``kernels``).
        self.kernel_size = (2 * max(up, down) + 1, wide, wide)
        self.voxel_size = float(voxel_size)

    @property
    def reach(self) -> tuple[int, int, int]:
        z, y, x = super().reach
        if self.metric is None:
            return z, y, x
        wide = whole_voxels(self.metric.section_radius, self.voxel_size)
        high = whole_voxels(self.metric.section_above, self.voxel_size)
        return z + high, y + wide, x + wide

    def section(self, occupancy: Occupancy) -> tuple[np.ndarray, np.ndarray]:
        """The occupied voxels in each one's section
        (``scenenet.convolution.cross_section.neighbours``)."""
        assert self.metric is not None
        lengths = self.metric.section_radius, self.metric.section_above
        return neighbours(occupancy, section_offsets(*lengths, self.voxel_size))

    def argmax_rows(self, occupancy: Occupancy, observed: Tensor) -> np.ndarray:
        if self.metric is None:
            return super().argmax_rows(occupancy, observed)
        return strongest(observed.detach().numpy(), *self.section(occupancy))

    def forward(self, occupancy: Occupancy) -> Tensor:
        """Probability of each voxel to hold a tower, (B, D, H, W) in [0, 1].

        In metres, that of an empty voxel is 0 and there is no gradient.
        """
        if self.metric is None:
            return super().forward(occupancy)
        kernel, _ = self.observer()
        observed = convolve_at_voxels(occupancy, kernel.detach().cpu()[None])[0]
        spoken = observed[torch.from_numpy(self.argmax_rows(occupancy, observed))]
        volume = torch.zeros(occupancy.n_voxels, dtype=observed.dtype)
        volume[torch.from_numpy(occupancy.flat())] = torch.relu(torch.tanh(spoken))
        return volume.reshape(len(occupancy), *occupancy.shape)

    def shape_of(self, name: str) -> dict[str, Tensor]:
        """Shape parameters of the GENEO called ``name``, by their symbol."""
        numbers = dict(cast(nn.ParameterDict, self.shapes[name]).items())
        if self.metric is None:
            return numbers
        ranges = {p.name: p.metric_range for p in self._parameters_of(name)}
        return {
            symbol: low * (high / low) ** torch.sigmoid(numbers[symbol])
            for symbol, (low, high) in ranges.items()
        }

    def _parameters_of(self, name: str) -> tuple[ShapeParameter, ...]:
        return kernel_named(self.geneos[self.names.index(name)]).parameters

    def mixing_weights(self) -> Tensor:
        """lambda, (K,), summing to one: the last is 1 minus the others (thesis 4.5)."""
        free = [self.mixing[name] for name in self.names[:-1]]
        if self.metric is not None:
            return torch.softmax(torch.stack([*free, torch.zeros(())]), dim=0)
        last = torch.ones(()) - sum(free, torch.zeros(()))
        return torch.stack([*free, last])

    def kernels(self) -> Tensor:
        """The sampled kernels, (K, kz, ky, kx), before mixing."""
        device = next(self.parameters()).device
        if self.metric is None:
            lattice = Lattice.of_size(self.kernel_size, device=device)
        else:
            lattice = Lattice.of_extent(
                self.kernel_size, self.metric.radius, self.voxel_size, device=device
            )
        sampled = torch.stack(
            [
                kernel_named(geneo).sample(lattice, self.shape_of(name))
                for name, geneo in zip(self.names, self.geneos, strict=True)
            ]
        )
        if self.metric is None or lattice.inside is None:
            return sampled
        ends = (lattice.z >= -self.metric.below * (1 + 1e-6)) & (
            lattice.z <= self.metric.above * (1 + 1e-6)
        )
        return sampled * lattice.inside * ends * (self.voxel_size / COLUMN_M)

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
        if self.metric is not None:
            self._set_logits(numbers)
            return
        with torch.no_grad():
            for name in self.names:
                for symbol, value in self.shape_of(name).items():
                    value.fill_(numbers[f"{name}.{symbol}"])
            for name in self.names[:-1]:
                self.mixing[name].fill_(numbers[f"lambda.{name}"])

    def _set_logits(self, numbers: Mapping[str, float]) -> None:
        for name in self.names:
            shape = cast(nn.ParameterDict, self.shapes[name])
            for parameter in self._parameters_of(name):
                low, high = parameter.metric_range
                value = numbers[f"{name}.{parameter.name}"]
                if not low * (1 - 1e-4) <= value <= high * (1 + 1e-4):
                    raise InputError(
                        f"{name}.{parameter.name} = {value:g} {parameter.metric_unit} does not lie "
                        f"within {low:g} to {high:g}"
                    )
                share = math.log(value / low) / math.log(high / low)
                shape[parameter.name].data.fill_(_logit(share))
        weights = [numbers[f"lambda.{name}"] for name in self.names]
        if min(weights) < 0:
            raise InputError("a mixing weight is negative")
        for name, weight in zip(self.names[:-1], weights, strict=False):
            self.mixing[name].data.fill_(math.log(max(weight, TINY) / max(weights[-1], TINY)))

    def numbers(self) -> np.ndarray:
        """The trained numbers as they are kept, (P,) float64, each kernel's and the mixing ones."""
        return np.array([float(p.detach()) for p in self.parameters()])

    def set_numbers(self, numbers: np.ndarray) -> None:
        """Take what ``numbers`` gives."""
        for parameter, value in zip(self.parameters(), numbers, strict=True):
            parameter.data.fill_(float(value))

    def with_kernel_size(self, kernel_size: KernelSize) -> SceneNet:
        """The same parameters sampled at another size (thesis 5.2.7, Table 5.4).

        Raises:
            InputError: the kernels are in metres.
        """
        if self.metric is not None:
            raise InputError(
                "the kernels of this SCENE-Net are in metres, and the grid sets their voxels",
                remedy="Take a model of protocol thesis for other kernel sizes",
            )
        other = SceneNet(self.geneos, kernel_size)
        other.load_state_dict(self.state_dict())
        return other


TINY = 1e-9
"""A mixing weight below it is read as this one."""
LOGIT_END = 16.0
"""Where a logit ends: float32 cannot tell a sigmoid beyond it from its bound."""


def _logit(share: float) -> float:
    if share <= 0 or share >= 1:
        return LOGIT_END if share >= 1 else -LOGIT_END
    return max(-LOGIT_END, min(LOGIT_END, math.log(share / (1 - share))))


def _distinct(names: Sequence[str]) -> list[str]:
    """Names with a number behind the second and later of a kind: arrow, arrow_2."""
    seen: dict[str, int] = {}
    distinct = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        distinct.append(name if seen[name] == 1 else f"{name}_{seen[name]}")
    return distinct
