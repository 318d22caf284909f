"""SCENE-Net with kernels in metres (docs/method/operational_protocol.md)."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Self

import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.coarsening import block_edge
from scenenet.convolution.convolve import convolve_at_voxels
from scenenet.convolution.cross_section import (
    Section,
    part_of,
    section_of,
    section_offsets,
    strongest,
    whole_voxels,
)
from scenenet.convolution.occupancy import Occupancy
from scenenet.core.errors import InputError
from scenenet.geneo import Extent, ShapeParameter
from scenenet.metrics.threshold_choice import best_step
from scenenet.metrics.threshold_curve import ThresholdCurve
from scenenet.models import bounded_numbers
from scenenet.models.evidence import Evidence
from scenenet.models.geneo_model import GeneoModel, RespondsAt
from scenenet.models.known_answers import KnownAnswers
from scenenet.models.metric_kernels import KeptKernels, KernelGrid
from scenenet.models.settings import (
    LARGEST_LENGTH,
    THESIS_GENEOS,
    KernelSize,
    MetricSettings,
    Mixing,
)

BEYOND_REACH_M = 1.0
"""m that a kernel reaches beyond the crossarms: a voxel of air."""
CORNER_M = 0.5
"""m that a cross-section reaches beyond the corners of a body: half a voxel."""
TINY = 1e-9
"""Smallest mixing weight that is stored; smaller ones are replaced by it."""

Shapes = dict[str, dict[str, Tensor]]
"""The shape parameters of each GENEO by symbol, by the name of the GENEO."""


class MetricSceneNet(GeneoModel):
    """A SCENE-Net whose kernels have lengths in metres.

    - Kernels are sampled at the voxel size of the grid (``at``), and H is weighted by it: a tower
      column that is occupied over a given height has the same H on every grid.
    - Parameters are stored as logits between their bounds and mixing weights as softmax logits, so
      every parameter is positive and every mixture convex.
    - With ``metric.numbers`` ``measured``, the body and the crossarms have the lengths of the
      labelled towers, kernels reach ``metric.radius`` beyond them, and each kernel accounts for the
      extent of the voxels (``scenenet.geneo.kernel.seen_shell``).
    - An empty voxel has probability 0. An occupied voxel takes the strongest response in its
      cross-section (``scenenet.convolution.cross_section``).
    - With a first observer, the measurement phi is the probability that this one gives. The
      composition of GENEOs is a GENEO. Voxels with phi 0 count as empty.

    Attributes:
        metric: the lengths, m.
        first: the observer whose answer is the measurement of this one; None for one that
            measures points.
        voxel_size: m, edge of the voxels that the kernels are sampled at.
        evidence: what the training data say about each number, by name; empty before training and
            for files of earlier versions.
    """

    units = "m"
    tau_from_training = True
    voxel_size: float

    def __init__(
        self,
        geneos: Sequence[str] = THESIS_GENEOS,
        metric: MetricSettings | None = None,
        *,
        first: MetricSceneNet | None = None,
        generator: torch.Generator | None = None,
    ) -> None:
        """Draw the parameters at random over their ranges; the initial voxel size is 1 m.

        Args:
            geneos: kernel names; a name may be repeated.
            metric: lengths; the defaults if None.
            first: as in the attributes.
            generator: source of the random numbers; torch's default if None.

        Raises:
            InputError: a kernel is unknown, or ``geneos`` is empty.
        """
        super().__init__(geneos, generator)
        self.metric = metric or MetricSettings()
        self.first = first
        self.evidence: dict[str, Evidence] = {}
        self._kept = KeptKernels()
        self._decoded: dict[str, tuple[Hashable, dict[str, Tensor]]] = {}
        for label, value in self._own_fixed().items():
            name, symbol = label.rsplit(".", 1)
            parameter = next(p for p in self.parameters_of(name) if p.name == symbol)
            self._store(name, parameter, value)
        self._discretise(1.0)

    @classmethod
    def composed(
        cls,
        geneos: Sequence[str],
        first: Sequence[str],
        metric: MetricSettings,
        generator: torch.Generator | None = None,
    ) -> Self:
        """A new model whose first observer has the kernels ``first``; none if there are no such
        kernels. The first observer answers for each voxel itself, not for a cross-section."""
        before = None
        if first:
            plain = {"section_radius": 0.0, "section_above": 0.0, "mixing": "convex"}
            alone = metric.model_copy(update=plain)
            before = cls(first, alone, generator=generator)
        return cls(geneos, metric, first=before, generator=generator)

    def _initial_shape(self, parameter: ShapeParameter, drawn: Tensor) -> Tensor:
        return bounded_numbers.initial(drawn)

    def _initial_mixing(self, drawn: Tensor) -> Tensor:
        return 6 * drawn - 3

    def at(self, voxel_size: float) -> Self:
        """The model sampled at voxels of ``voxel_size`` m, sharing the trained numbers.

        Raises:
            InputError: a kernel would have more than ``LARGEST_KERNEL`` voxels along an edge.
        """
        if voxel_size == self.voxel_size:
            return self
        other = copy.copy(self)  # shallow: both models share the trained numbers
        if self.first is not None:
            other._modules = dict(self._modules)
            other.first = self.first.at(voxel_size)
        other._discretise(voxel_size)
        return other

    @property
    def measured(self) -> bool:
        """Whether radius and reach are measured (``MetricSettings.numbers``)."""
        return self.metric.numbers == "measured"

    def bounds_of(self, parameter: ShapeParameter) -> tuple[float, float]:
        """The bounds of a shape parameter, positive, in its metric unit."""
        return parameter.physical_range if self.measured else parameter.metric_range

    def measured_numbers(self) -> dict[str, str]:
        """The numbers that are measured in points, and the field of
        ``scenenet.dataset.tower_shapes.TowerShape`` of each."""
        found = {}
        for name in self.names if self.measured else ():
            for parameter in self.parameters_of(name):
                if parameter.measured is not None:
                    found[f"{name}.{parameter.name}"] = parameter.measured
        return found

    def fixed_numbers(self) -> dict[str, float]:
        """The numbers that are neither measured nor searched, with their values."""
        before = {} if self.first is None else self.first.fixed_numbers()
        return self._own_fixed() | {f"first.{name}": value for name, value in before.items()}

    def _own_fixed(self) -> dict[str, float]:
        found = {}
        for name in self.names if self.measured else ():
            for parameter in self.parameters_of(name):
                if parameter.fixed is not None:
                    found[f"{name}.{parameter.name}"] = parameter.fixed
        return found

    def body_radius(self) -> float:
        """m, radius of the body that kernels and cross-sections follow; 0 where they do not."""
        return self._body_radius(self._shapes())

    def _body_radius(self, shapes: Shapes) -> float:
        return max(self._measured_as("half_width", shapes).values(), default=0.0)

    def _measured_as(self, field: str, shapes: Shapes) -> dict[str, float]:
        """The number of each GENEO that is measured as ``field``, m, by name."""
        return {
            name: float(shapes[name][parameter.name].detach())
            for name in (self.names if self.measured else ())
            for parameter in self.parameters_of(name)
            if parameter.measured == field
        }

    @property
    def section_radius(self) -> float:
        """m, radius of the cross-section: the body with its corners."""
        body = self.body_radius()
        corners = math.sqrt(2) * body + CORNER_M if body else 0.0
        return max(self.metric.section_radius, corners)

    def _extents(self, shapes: Shapes) -> dict[str, Extent]:
        """m, how far each GENEO reaches, by name."""
        support = self.metric.radius + self._body_radius(shapes)
        heads = self._measured_as("reach", shapes)
        found = {}
        for name, shape in shapes.items():
            around = max(support, heads[name] + BEYOND_REACH_M) if name in heads else support
            numbers = {symbol: float(value.detach()) for symbol, value in shape.items()}
            own = self.kernel_of(name).extent(numbers)
            general = Extent(self.metric.above, self.metric.below, min(around, LARGEST_LENGTH))
            found[name] = own or general
        return found

    def _discretise(self, voxel_size: float) -> None:
        extents = self._extents(self._shapes()).values()
        seen = voxel_size if self.measured else 0.0
        self._grid = KernelGrid.holding(extents, voxel_size, seen)
        self.kernel_size = self._grid.size
        self.voxel_size = self._grid.voxel_size

    def block_edge(self, voxel_size: float) -> int:
        return block_edge(voxel_size, self.metric.observed)

    def observed_size(self, voxel_size: float) -> float:
        return voxel_size * self.block_edge(voxel_size)

    @property
    def whole_towers(self) -> bool:
        return self.metric.whole_towers

    def best_tau(self, curve: ThresholdCurve) -> float:
        """tau with the highest F0.5 when a false voxel counts ``metric.false_weight`` times."""
        return float(curve.tau[self.best_step(curve)[0]])

    def best_step(self, curve: ThresholdCurve) -> tuple[int, float]:
        """Index of ``best_tau`` in the thresholds, and the weighted F0.5 at it."""
        return best_step(curve, self.metric.false_weight)

    @property
    def reach(self) -> tuple[int, int, int]:
        z, y, x = super().reach
        wide = whole_voxels(self.section_radius, self.voxel_size)
        high = whole_voxels(self.metric.section_above, self.voxel_size)
        before = (0, 0, 0) if self.first is None else self.first.reach
        return z + high + before[0], y + wide + before[1], x + wide + before[2]

    def section(self, occupancy: Occupancy) -> Section:
        """The cross-section of each occupied voxel. With measured numbers it has empty voxels too,
        because the axis of a wide tower is in the air."""
        return section_of(occupancy, self._section_offsets(), hollow=self._hollow)

    def _section_offsets(self) -> np.ndarray:
        lengths = self.section_radius, self.metric.section_above
        return section_offsets(*lengths, self.voxel_size)

    @property
    def _hollow(self) -> bool:
        return self.measured and self.linear

    @property
    def linear(self) -> bool:
        return super().linear and self.first is None

    @property
    def mixes(self) -> Mixing:
        return self.metric.mixing

    def responder(self, known: KnownAnswers | None = None) -> Callable[[Occupancy], Tensor]:
        if self.linear:
            return super().responder()
        if self.first is None:
            answer, measure = super().responder(known), None
        else:
            measure = self.first.responder(known)
            # What this observer measures changes with the weights of the first one.
            answer = super().responder(None if known is None else known.of_kernels())

        def parts(occupancy: Occupancy) -> Tensor:
            if measure is None:
                return _strongest_parts(answer(occupancy), self.section(occupancy))
            phi = torch.relu(torch.tanh(measure(occupancy).sum(dim=0)))
            found = torch.zeros((len(self.names), len(occupancy.index)), dtype=phi.dtype)
            measured = occupancy.measured(phi.numpy())
            found[:, phi > 0] = _strongest_parts(answer(measured), self.section(measured))
            return found

        return parts

    def row_responder(self, *, above_zero: bool = False) -> RespondsAt:
        """A function from grids and the rows (R,) of some of their occupied voxels, ascending, to
        the parts (K, R) of H there. They equal those of ``responder``. With a first observer, the
        values of the grids are its answers, all above 0.

        Args:
            above_zero: as ``responder_at``.
        """
        answer = self.responder_at(above_zero=above_zero)
        offsets = self._section_offsets()

        def parts(occupancy: Occupancy, rows: np.ndarray) -> Tensor:
            section = part_of(section_of(occupancy, offsets, hollow=self._hollow), rows)
            needed = np.unique(section.rows)
            found = answer(occupancy, occupancy.flat()[needed])
            own = section._replace(rows=np.searchsorted(needed, section.rows).astype(np.int32))
            return _strongest_parts(found, own)

        return parts

    def responses(self, occupancy: Occupancy, kernels: Tensor) -> Tensor:
        section = self.section(occupancy)
        return _strongest_parts(convolve_at_voxels(occupancy, kernels, section.at), section)

    def forward(self, occupancy: Occupancy) -> Tensor:
        """Probability that each voxel belongs to the target, (B, D, H, W) in [0, 1].

        It is 0 in empty voxels, and there is no gradient.
        """
        if self.linear:
            kernel, _ = self.observer()
            observed = self.responses(occupancy, kernel.detach()[None])[0]
        else:
            observed = self.responder()(occupancy).sum(dim=0)
        volume = torch.zeros(occupancy.n_voxels, dtype=observed.dtype)
        volume[torch.from_numpy(occupancy.flat())] = torch.relu(torch.tanh(observed))
        return volume.reshape(len(occupancy), *occupancy.shape)

    def shape_of(self, name: str) -> dict[str, Tensor]:
        stored = self._stored_shape(name)
        ranges = {p.name: self.bounds_of(p) for p in self.parameters_of(name)}
        return {
            symbol: bounded_numbers.decoded(stored[symbol], low, high)
            for symbol, (low, high) in ranges.items()
        }

    def _shapes(self) -> Shapes:
        return {name: self._kept_shape(name) for name in self.names}

    def _kept_shape(self, name: str) -> dict[str, Tensor]:
        """``shape_of``, which without a gradient is kept: it is the same for voxels of every size,
        and each crop may have voxels of its own size."""
        if torch.is_grad_enabled():
            return self.shape_of(name)
        made_from = tuple(float(number) for number in self._stored_shape(name).values())
        kept, shape = self._decoded.get(name, (None, {}))
        if kept != made_from:
            shape = self.shape_of(name)
            self._decoded[name] = made_from, shape
        return shape

    def mixing_weights(self) -> Tensor:
        """lambda, (K,), positive, sums to 1: a softmax whose last logit is 0."""
        free = [self.mixing[name] for name in self.names[:-1]]
        return torch.softmax(torch.stack([*free, torch.zeros(())]), dim=0)

    def kernels(self) -> Tensor:
        shapes = self._shapes()
        extents = self._extents(shapes)
        along_x = [
            self._kept.along_x(name, self.kernel_of(name), shape, extents[name], self._grid)
            for name, shape in shapes.items()
        ]
        return torch.stack(along_x)

    def orbits(self) -> list[Tensor]:
        shapes = self._shapes()
        extents = self._extents(shapes)
        return [
            self._grid.sample(self.kernel_of(name), shapes[name], extents[name])
            for name in self.names
        ]

    def orbit_of(self, name: str, azimuth: float = 0.0) -> Tensor:
        shapes = self._shapes()
        extent = self._extents(shapes)[name]
        return self._grid.sample(self.kernel_of(name), shapes[name], extent, azimuth)

    def unit_of(self, parameter: ShapeParameter) -> str:
        return parameter.metric_unit

    def length_unit_m(self, voxel_size: float) -> float:
        return 1.0

    def _assign(self, numbers: Mapping[str, float]) -> None:
        for name in self.names:
            for parameter in self.parameters_of(name):
                low, high = self.bounds_of(parameter)
                value = numbers[f"{name}.{parameter.name}"]
                if not low * (1 - 1e-4) <= value <= high * (1 + 1e-4):
                    raise InputError(
                        f"{name}.{parameter.name} = {value:g} {parameter.metric_unit} does not lie "
                        f"within {low:g} to {high:g}"
                    )
                self._store(name, parameter, value)
        weights = [numbers[f"lambda.{name}"] for name in self.names]
        if min(weights) < 0:
            raise InputError("a mixing weight is negative")
        for name, weight in zip(self.names[:-1], weights, strict=False):
            self.mixing[name].data.fill_(math.log(max(weight, TINY) / max(weights[-1], TINY)))
        self._discretise(self.voxel_size)

    def stages(self) -> list[tuple[str, GeneoModel]]:
        before = [] if self.first is None else self.first.stages()
        return [*super().stages(), *((f"first.{prefix}", model) for prefix, model in before)]

    def set_numbers(self, numbers: np.ndarray) -> None:
        super().set_numbers(numbers)
        self._follow_numbers()

    def _follow_numbers(self) -> None:
        """Make the kernels as large as their lengths require."""
        if self.first is not None:
            self.first._follow_numbers()
        self._discretise(self.voxel_size)

    def _store(self, name: str, parameter: ShapeParameter, value: float) -> None:
        low, high = self.bounds_of(parameter)
        stored = bounded_numbers.encoded(value, low, high)
        self._stored_shape(name)[parameter.name].data.fill_(stored)

    def with_kernel_size(self, kernel_size: KernelSize) -> Self:
        raise InputError(
            "the kernels of this SCENE-Net are in metres; their voxels follow from the grid",
            remedy="Use a model of protocol thesis for other kernel sizes",
        )


def _strongest_parts(parts: Tensor, section: Section) -> Tensor:
    """The parts (K, M) of the voxel that responds most in each cross-section, from those (K, C) at
    the voxels of ``section.at``."""
    rows = strongest(parts.sum(dim=0).numpy(), section.starts, section.rows)
    return parts[:, torch.from_numpy(rows)]
