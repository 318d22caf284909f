"""GENEO kernels: functions of space with shape parameters, sampled on a voxel lattice."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import torch
from torch import Tensor

from scenenet.geneo.lattice import Lattice
from scenenet.geneo.sentences import Sentence, body_radius

MIN_SIGMA = 1e-6
"""Smallest sigma of a shell, in squared units of length."""


@dataclass(frozen=True)
class ShapeParameter:
    """One trainable number of a kernel.

    Attributes:
        name: its symbol in the thesis, spelt out (``r``, ``sigma``, ``omega``).
        low, high: the range of its initial value, in ``unit``.
        unit: ``voxel``, ``voxel^2`` or ``1``.
        meaning: what it stands for in the scene, as a noun phrase.
        metric: its bounds for kernels in metres, in ``metric_unit``. None takes low and high, with
            low raised to at least a thousandth of high.
        by_hand: the value that a person who knows towers would choose, in ``unit`` (thesis 5.3.4,
            "handcrafted values"); None takes the middle of the range.
        sentence: describes its value in metres (thesis 5.2.2); None takes ``meaning`` and the
            value.
        physical: its bounds in kernels with measured numbers, in ``metric_unit``: what towers can
            have. None takes those of kernels in metres.
        measured: the field of ``scenenet.dataset.tower_shapes.TowerShape`` that gives its value in
            such kernels; None leaves it to the search.
        fixed: its value in such kernels where neither points nor scores determine it.
    """

    name: str
    low: float
    high: float
    unit: str
    meaning: str
    metric: tuple[float, float] | None = None
    by_hand: float | None = None
    sentence: Sentence | None = None
    physical: tuple[float, float] | None = None
    measured: str | None = None
    fixed: float | None = None

    @property
    def handcrafted(self) -> float:
        """The handcrafted value, in ``unit``."""
        return (self.low + self.high) / 2 if self.by_hand is None else self.by_hand

    @property
    def metric_unit(self) -> str:
        """``m``, ``m^2`` or ``1``: its unit for kernels in metres."""
        return self.unit.replace("voxel", "m")

    @property
    def metric_range(self) -> tuple[float, float]:
        """Positive bounds, in ``metric_unit``."""
        return self.metric or (max(self.low, 1e-3 * self.high), self.high)

    @property
    def physical_range(self) -> tuple[float, float]:
        """Positive bounds in kernels with measured numbers, in ``metric_unit``."""
        return self.physical or self.metric_range


BODY_RADIUS = ShapeParameter(
    "r",
    0.2,
    2.0,
    "voxel",
    "radius of the tower's body",
    metric=(0.1, 1.5),
    by_hand=2.0,
    sentence=body_radius,
    physical=(0.05, 4.0),
    measured="half_width",
)
"""Radius of a tower's body, which the cylinder and the arrow share. The handcrafted value is half
the mean width of 4.15 m (thesis 5.1.2) in voxels of about a metre, the size in a crop at 64^3."""


def shell_sigma(
    meaning: str,
    sentence: Sentence,
    physical: tuple[float, float] | None = None,
    measured: str | None = None,
) -> ShapeParameter:
    """The tolerance sigma of a shell, whose ranges in voxels and in metres all kernels share."""
    return ShapeParameter(
        "sigma",
        0.5,
        3.0,
        "voxel^2",
        meaning,
        metric=(0.15, 2.25),
        sentence=sentence,
        physical=physical,
        measured=measured,
    )


class Extent(NamedTuple):
    """How far a kernel reaches from its centre, in the unit of its lengths.

    Attributes:
        up, down, around: upwards, downwards, and in plan.
    """

    up: float
    down: float
    around: float


class GeneoKernel(ABC):
    """A family of kernels g: R^3 -> R with shape parameters (thesis 4.4).

    To add one, put a file with a subclass into ``scenenet/geneo/kernels`` and decorate it with
    ``scenenet.geneo.register``; no other file changes.

    A kernel with a direction points along x. The operator is then the maximum of the responses of
    the kernel over an orbit, its turns about z, and a turn by a multiple of 360 degrees over
    ``turns`` only permutes the orbit. A maximum of non-expansive operators is non-expansive too, so
    the operator is a GENEO with respect to these turns (Eq. 3.1, 3.2).

    Attributes:
        name: its name in settings, model files and tables.
        parameters: the shape parameters, in the order in which tables list them.
        sums_to_zero: whether every horizontal slice sums to zero by design (thesis 4.4.1); the
            certificate of a model verifies it.
        turns: number of turns about z in its orbit; 1 for a kernel without a direction, which is
            the same after every turn.
        slopes: rises of the kernel along its direction, as ratios; the maximum is over them too.
        adds_up_height: whether its response is a sum over heights, as that of a tower's body, so
            that a model in metres weighs it by the edge of a voxel.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[ShapeParameter, ...]]
    sums_to_zero: ClassVar[bool] = False
    turns: ClassVar[int] = 1
    slopes: ClassVar[tuple[float, ...]] = (0.0,)
    adds_up_height: ClassVar[bool] = True

    @abstractmethod
    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        """The kernel's values on the lattice; differentiable in every shape parameter.

        Args:
            lattice: the positions, in the frame of the kernel.
            shape: a 0-dimensional tensor for each of ``parameters``, by name.

        Returns:
            (kz, ky, kx), axes z (up), y, x of the grid.
        """

    def extent(self, shape: Mapping[str, float]) -> Extent | None:
        """How far it reaches with these numbers, in the unit of its lengths; None if it fills the
        lengths that the settings of a model give all kernels (``MetricSettings``)."""
        return None

    @property
    def oriented(self) -> bool:
        """Whether it has a direction."""
        return self.turns > 1 or self.slopes != (0.0,)

    def orbit(self, lattice: Lattice, shape: Mapping[str, Tensor], azimuth: float = 0.0) -> Tensor:
        """The kernel in all its directions, (turns * slopes, kz, ky, kx), of which the first is
        ``azimuth``, radians from x towards y.

        On a lattice that a quarter turn leaves unchanged, the other quarters are turned copies, so
        that the operator is equivariant under quarter turns to the last digit.
        """
        _, ky, kx = lattice.size
        quarters = 4 if self.turns % 4 == 0 and ky == kx and ky % 2 == 1 else 1
        first = [
            self.sample(lattice.turned(azimuth + 2 * math.pi * turn / self.turns, slope), shape)
            for turn in range(self.turns // quarters)
            for slope in self.slopes
        ]
        quarter = torch.stack(first)
        # Rows are y and columns x, so a turn from x towards y is a turn from columns to rows.
        return torch.cat([torch.rot90(quarter, -n, (2, 3)) for n in range(quarters)])


def zero_sum(kernel: Tensor, inside: Tensor | None = None) -> Tensor:
    """The kernel less the mean of each horizontal slice (thesis 4.4.1: "normalized").

    A kernel that sums to zero gives no response to uniform surroundings, and a negative one to
    points where its pattern has none. Each slice is balanced on its own, so a scene that is uniform
    in the plane but changes with height, such as bare ground, gives no response either.

    Args:
        kernel: (kz, ky, kx).
        inside: (1, ky, kx) of 0 and 1, ``Lattice.inside``; the kernel is zero where it is 0.

    Returns:
        (kz, ky, kx), each [z] summing to zero.
    """
    if inside is None:
        return kernel - kernel.mean(dim=(1, 2), keepdim=True)
    kernel = kernel * inside
    return kernel - inside * (kernel.sum(dim=(1, 2), keepdim=True) / inside.sum())


def seen_shell(lattice: Lattice, radius: Tensor, sigma: Tensor) -> Tensor:
    """The shell of ``gaussian_shell`` as it is seen in voxels; each slice sums to 1.

    A voxel says that a point is somewhere in it. If a point at distance d is uniform in its voxel
    of edge a, d^2 is larger by a^2 / 6 on average, and its variance by d^2 a^2 / 3 + a^4 / 90. A
    body that is thinner than a voxel keeps its radius and tolerance, and the kernel is still as
    wide as a voxel. Its response is the occupied share of the shell, which hardly depends on how
    many voxels a shell has on a grid.

    Args:
        radius: m, () or (kz, 1, 1).
        sigma: m^2, ().

    Returns:
        (kz or 1, ky, kx).
    """
    edge = lattice.voxel**2
    spread = (sigma.square() + radius.square() * edge / 3 + edge**2 / 90).sqrt()
    shell = gaussian_shell(lattice.planar_squared, radius.square() + edge / 6, spread)
    return normalised(shell if lattice.inside is None else shell * lattice.inside)


def per_support(kernel: Tensor, lattice: Lattice) -> Tensor:
    """A kernel (kz, ky, kx) divided by the number of voxels of its support in a slice where numbers
    are measured, so that it gives an occupied share on every grid; unchanged otherwise."""
    if not lattice.voxel or lattice.inside is None:
        return kernel
    return kernel / lattice.inside.sum()


def full_ball(lattice: Lattice, radius: Tensor) -> Tensor:
    """A ball (kz, ky, kx) of ``radius``, whose response to a full flat surface through its centre
    is 1. It falls off within a voxel, so that its size has a gradient."""
    ball = ((radius - lattice.squared.sqrt()) / lattice.step + 0.5).clamp(0, 1)
    return ball * (lattice.step**2 / (math.pi * radius.square()))


def normalised(kernel: Tensor) -> Tensor:
    """A kernel (kz, ky, kx) that is not negative, with each slice divided by its sum; empty slices
    stay empty."""
    total = kernel.sum(dim=(1, 2), keepdim=True)
    return kernel / total.clamp(min=torch.finfo(kernel.dtype).tiny)


def column(lattice: Lattice, radius: Tensor) -> Tensor:
    """(1, ky, kx): 1 within ``radius`` m of the axis, and falling to 0 within a voxel beyond."""
    edge = lattice.voxel
    beyond = (lattice.planar_squared.sqrt() - radius).clamp(min=0)
    return (1 - beyond / edge).clamp(min=0)


def gaussian_shell(squared_distance: Tensor, squared_radius: Tensor, sigma: Tensor) -> Tensor:
    """exp(-(d^2 - r^2)^2 / (2 sigma^2)): 1 at radius r, decreasing on both sides.

    The thesis compares squared lengths, so sigma is a squared length as well. Where |sigma| is
    below ``MIN_SIGMA``, which the penalty on negative parameters can cause, ``MIN_SIGMA`` is used:
    the values stay finite and the gradients are 0 instead of 0 / 0.
    """
    spread = 2 * sigma.square().clamp(min=MIN_SIGMA**2)
    return torch.exp(-((squared_distance - squared_radius) ** 2) / spread)
