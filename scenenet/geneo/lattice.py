"""The positions at which a kernel is sampled, in the frame of the kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import torch
from torch import Tensor

KEPT = 64
"""Lattices in metres that are kept: a search samples its kernels thousands of times on a few."""


@dataclass(frozen=True)
class Lattice:
    """The positions at which a kernel is sampled, in voxels or in metres.

    The kernel's centre lies on element ``(k - 1) // 2`` of each axis, the element that the
    convolution aligns with the output voxel (see ``scenenet.convolution.convolve``). An even size
    has one more element on the high side, so no size shifts the response by half a voxel.

    Shapes are those of a lattice as it is made; a turned one has tensors that broadcast to
    (kz, ky, kx) in their place.

    Attributes:
        size: (kz, ky, kx).
        z: (kz, 1, 1) height above the centre.
        planar_squared: (1, ky, kx) squared distance from the vertical axis, ||pi_-3(x - c)||^2.
        y: (1, ky, 1) distance from the centre along y.
        x: (1, 1, kx) distance from the centre along x, the direction in which a kernel with a
            direction points.
        step: distance between neighbouring elements: 1 voxel, or the edge of a voxel in m.
        inside: (1, ky, kx), 1 in the support of the kernel and 0 elsewhere; None if the support is
            the whole box.
        voxel: m, edge of the voxels in which the points are, for kernels with measured numbers. 0
            samples the formula of a kernel at the centres of the voxels.
    """

    size: tuple[int, int, int]
    z: Tensor
    planar_squared: Tensor
    y: Tensor
    x: Tensor
    step: float = 1.0
    inside: Tensor | None = None
    voxel: float = 0.0

    @classmethod
    def of_size(
        cls,
        size: tuple[int, int, int],
        dtype: torch.dtype = torch.float32,
    ) -> Lattice:
        """The lattice in voxels of a kernel of ``size`` (kz, ky, kx), each at least 1.

        Raises:
            ValueError: the size is not three positive integers.
        """
        if len(size) != 3 or min(size) < 1:
            raise ValueError(f"kernel size must be three positive integers, not {size}")
        z, y, x = (torch.arange(k, dtype=dtype) - (k - 1) // 2 for k in size)
        planar = y[:, None] ** 2 + x[None, :] ** 2
        return cls(size, z[:, None, None], planar[None], y[None, :, None], x[None, None, :])

    @classmethod
    @lru_cache(maxsize=KEPT)
    def of_extent(
        cls,
        size: tuple[int, int, int],
        radius: float,
        voxel_size: float,
        dtype: torch.dtype = torch.float32,
        voxel: float = 0.0,
    ) -> Lattice:
        """The lattice in metres, limited to ``radius`` around the vertical axis. A disc has no
        corners, which would change the response when the scene rotates.

        Args:
            size: (kz, ky, kx), all odd.
            radius, voxel_size: m.
            voxel: m, as in the attributes.
        """
        voxels = cls.of_size(size, dtype)
        planar = voxels.planar_squared * voxel_size**2
        inside = (planar <= (radius * (1 + 1e-6)) ** 2).to(dtype)
        z, y, x = (axis * voxel_size for axis in (voxels.z, voxels.y, voxels.x))
        return cls(size, z, planar, y, x, voxel_size, inside, voxel)

    @property
    def top(self) -> float:
        """Height of the highest element above the centre."""
        return float(self.z[-1, 0, 0])

    @property
    def squared(self) -> Tensor:
        """(kz, ky, kx) squared distance from the centre, ||x - c||^2."""
        return self.planar_squared + self.z**2

    def turned(self, azimuth: float, slope: float = 0.0) -> Lattice:
        """The same positions in the frame of a kernel that points elsewhere.

        Args:
            azimuth: radians from the x axis towards the y axis, the direction of the kernel in
                plan.
            slope: rise of the kernel along this direction, as a ratio.
        """
        cos, sin = math.cos(azimuth), math.sin(azimuth)
        along, y = self.x * cos + self.y * sin, self.y * cos - self.x * sin
        if slope == 0:
            return replace(self, x=along, y=y)
        level = 1 / math.hypot(1, slope)
        rise = slope * level
        x, z = along * level + self.z * rise, self.z * level - along * rise
        return replace(self, x=x, y=y, z=z, planar_squared=x**2 + y**2)
