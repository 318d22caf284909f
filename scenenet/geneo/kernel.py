"""What a GENEO kernel is: a function of space with shape parameters, sampled on a voxel lattice."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor

from scenenet.geneo.sentences import Sentence

BASE = 2.0
"""Radius in voxels that a tower's body has by hand: half of the mean width of 4.15 m (thesis 5.1.2)
in voxels of about a metre, as a crop has at 64^3."""

THINNEST = 1e-6
"""Least sigma of a shell, in squared units of length."""


@dataclass(frozen=True)
class ShapeParameter:
    """One trainable number of a kernel.

    Attributes:
        name: its symbol in the thesis, spelt out (``r``, ``sigma``, ``omega``).
        low, high: the range it is drawn from at the start of training, in units of ``unit``.
        unit: ``voxel``, ``voxel^2`` or ``1``.
        meaning: what it says about a tower, as part of a sentence.
        metric: the range it stays within where kernels are in metres, in ``metric_unit``; low and
            high, and never below a thousandth of high, if None.
        by_hand: what somebody who knows towers would set it to, in ``unit`` (thesis 5.3.4,
            "handcrafted values"); the middle of the range if None.
        sentence: its value in metres in words (thesis 5.2.2); ``meaning`` and the value if None.
    """

    name: str
    low: float
    high: float
    unit: str
    meaning: str
    metric: tuple[float, float] | None = None
    by_hand: float | None = None
    sentence: Sentence | None = None

    @property
    def handcrafted(self) -> float:
        """Its value by hand, in ``unit``."""
        return (self.low + self.high) / 2 if self.by_hand is None else self.by_hand

    @property
    def metric_unit(self) -> str:
        """``m``, ``m^2`` or ``1``: its unit where kernels are in metres."""
        return self.unit.replace("voxel", "m")

    @property
    def metric_range(self) -> tuple[float, float]:
        """Bounds above zero, in ``metric_unit``."""
        return self.metric or (max(self.low, 1e-3 * self.high), self.high)


@dataclass(frozen=True)
class Lattice:
    """The places at which a kernel is sampled, in voxels or in metres.

    The kernel's centre lies on element ``(k - 1) // 2`` of each axis, the element that the
    convolution puts on the voxel it answers for (see ``scenenet.convolution.convolve``). An even
    size has one more element on the high side; so no size shifts the answer by half a voxel.

    Attributes:
        size: (kz, ky, kx).
        z: (kz, 1, 1) height above the centre.
        planar_squared: (1, ky, kx) squared distance from the vertical axis, ||pi_-3(x - c)||^2.
        inside: (1, ky, kx) of 0 and 1, where the kernel is; None for all of it.
    """

    size: tuple[int, int, int]
    z: Tensor
    planar_squared: Tensor
    inside: Tensor | None = None

    @classmethod
    def of_size(
        cls,
        size: tuple[int, int, int],
        dtype: torch.dtype = torch.float32,
    ) -> Lattice:
        """The lattice of a kernel of ``size`` (kz, ky, kx), each at least 1."""
        if len(size) != 3 or min(size) < 1:
            raise ValueError(f"kernel size must be three positive integers, not {size}")
        z, y, x = (torch.arange(k, dtype=dtype) - (k - 1) // 2 for k in size)
        planar = y[:, None] ** 2 + x[None, :] ** 2
        return cls(size, z[:, None, None], planar[None])

    @classmethod
    def of_extent(
        cls,
        size: tuple[int, int, int],
        radius: float,
        voxel_size: float,
        dtype: torch.dtype = torch.float32,
    ) -> Lattice:
        """The same in metres, within ``radius`` of the vertical axis; a disc has no corners that
        would stand out when the scene is turned.

        Args:
            size: (kz, ky, kx), all odd.
            radius, voxel_size: m.
        """
        voxels = cls.of_size(size, dtype)
        planar = voxels.planar_squared * voxel_size**2
        inside = (planar <= (radius * (1 + 1e-6)) ** 2).to(dtype)
        return cls(size, voxels.z * voxel_size, planar, inside)

    @property
    def top(self) -> float:
        """Height of the highest element above the centre."""
        return float(self.z[-1, 0, 0])


class GeneoKernel(ABC):
    """A family of kernels g: R^3 -> R with shape parameters (thesis 4.4).

    To add one, put a file with a subclass into ``scenenet/geneo/kernels`` and decorate it with
    ``scenenet.geneo.register``; no other file changes.

    Attributes:
        name: in settings, model files and tables.
        parameters: the shape parameters, in the order of tables.
        sums_to_zero: whether every horizontal slice is meant to sum to zero (thesis 4.4.1); the
            certificate of a model verifies it.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[ShapeParameter, ...]]
    sums_to_zero: ClassVar[bool] = False

    @abstractmethod
    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        """The kernel's values on the lattice.

        Args:
            lattice: where to sample.
            shape: a 0-dimensional tensor for each of ``parameters``; the answer is differentiable
                in every one.

        Returns:
            (kz, ky, kx), axes z (up), y, x.
        """


def zero_sum(kernel: Tensor, inside: Tensor | None = None) -> Tensor:
    """The kernel with its mean taken off each horizontal slice (thesis 4.4.1: "normalized").

    A kernel that sums to zero answers nothing to uniform surroundings and punishes points where
    the pattern has none. Each slice is balanced on its own, so a scene that is uniform in the plane
    but changes with height, as bare ground does, is answered with zero as well.

    Args:
        kernel: (kz, ky, kx).
        inside: (1, ky, kx) of 0 and 1, ``Lattice.inside``: elsewhere the kernel is zero.

    Returns:
        (kz, ky, kx), each [z] summing to zero.
    """
    if inside is None:
        return kernel - kernel.mean(dim=(1, 2), keepdim=True)
    kernel = kernel * inside
    return kernel - inside * (kernel.sum(dim=(1, 2), keepdim=True) / inside.sum())


def gaussian_shell(squared_distance: Tensor, squared_radius: Tensor, sigma: Tensor) -> Tensor:
    """exp(-(d^2 - r^2)^2 / (2 sigma^2)): one on the shell of radius r, falling off on both sides.

    The thesis compares squared lengths, so sigma is a squared length as well. One that is nearly 0,
    as a penalty leaves where it was negative, counts as ``THINNEST``: there is no shell to speak of
    left, but a number and a slope of 0 and not the quotient of two zeros.
    """
    spread = 2 * sigma.square().clamp(min=THINNEST**2)
    return torch.exp(-((squared_distance - squared_radius) ** 2) / spread)
