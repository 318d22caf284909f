"""Kernels with lengths in metres, sampled at the voxels of a grid."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping
from typing import NamedTuple, Self

import torch
from torch import Tensor

from scenenet.convolution.cross_section import whole_voxels
from scenenet.core.errors import InputError
from scenenet.geneo import Extent, GeneoKernel, Lattice
from scenenet.models.settings import LARGEST_KERNEL, KernelSize

COLUMN_M = 2.0
"""Occupied length of a tower's axis, m, at which the observer H is 1. It only sets the scale of H:
the twelve metres that the kernels reach then give at most 6, where float32 still resolves
probabilities."""
MOST_KEPT = 512
"""Sampled kernels that a model keeps."""


class KernelGrid(NamedTuple):
    """The voxels that kernels are sampled at, centred on the voxel that they respond at.

    Attributes:
        size: (kz, ky, kx), odd.
        voxel_size: m, edge of a voxel.
        seen: m, edge of the cube that a kernel sees in a voxel; 0 if it sees only the centre.
    """

    size: KernelSize
    voxel_size: float
    seen: float

    @classmethod
    def holding(cls, extents: Collection[Extent], voxel_size: float, seen: float) -> Self:
        """The smallest grid that holds kernels of these extents, m.

        Raises:
            InputError: it would have more than ``LARGEST_KERNEL`` voxels along an edge.
        """
        high = whole_voxels(max(max(e.up, e.down) for e in extents), voxel_size)
        wide = 2 * whole_voxels(max(e.around for e in extents), voxel_size) + 1
        # Centred on the voxel it responds at, so twice the longer side high; ``sample`` sets the
        # excess of the shorter side to zero.
        size = (2 * high + 1, wide, wide)
        if max(size) > LARGEST_KERNEL:
            raise InputError(
                f"its kernels would have {'x'.join(map(str, size))} voxels of {voxel_size:g} m, "
                f"and a kernel has at most {LARGEST_KERNEL} voxels along an edge",
                remedy="Sample them at the size of the blocks that the model observes "
                "(observed_size)",
            )
        return cls(size, float(voxel_size), float(seen))

    def sample(
        self,
        kernel: GeneoKernel,
        shape: Mapping[str, Tensor],
        extent: Extent,
        azimuth: float = 0.0,
        *,
        along_x: bool = False,
    ) -> Tensor:
        """A kernel in all its directions, or only along x, (n, kz, ky, kx).

        Args:
            kernel: the kernel.
            shape: its parameters by symbol, in metric units.
            extent: m, how far it reaches; it is 0 beyond.
            azimuth: radians that all directions are turned by.
            along_x: whether only the direction along x is sampled.
        """
        up, down, around = extent
        lattice = Lattice.of_extent(self.size, around, self.voxel_size, voxel=self.seen)
        ends = (lattice.z >= -down * (1 + 1e-6)) & (lattice.z <= up * (1 + 1e-6))
        assert lattice.inside is not None
        if along_x:
            sampled = kernel.sample(lattice, shape)[None]
        else:
            sampled = kernel.orbit(lattice, shape, azimuth)
        scale = self.voxel_size / COLUMN_M if kernel.adds_up_height else 1.0
        return sampled * lattice.inside * ends * scale


class KeptKernels:
    """The last kernel along x of each GENEO and voxel size, kept while there is no gradient.

    Whoever varies a number of one GENEO, or a mixing weight, asks for the kernels of the others
    again.
    """

    def __init__(self) -> None:
        self._kept: dict[tuple[str, float], tuple[Hashable, Tensor]] = {}

    def along_x(
        self,
        name: str,
        kernel: GeneoKernel,
        shape: Mapping[str, Tensor],
        extent: Extent,
        grid: KernelGrid,
    ) -> Tensor:
        """The kernel of the GENEO called ``name`` along x, (kz, ky, kx)."""
        if torch.is_grad_enabled():
            return grid.sample(kernel, shape, extent, along_x=True)[0]
        made_from = (grid.size, extent, *(float(number) for number in shape.values()))
        kept, sampled = self._kept.get((name, grid.voxel_size), (None, None))
        if sampled is None or kept != made_from:
            sampled = grid.sample(kernel, shape, extent, along_x=True)[0]
            if len(self._kept) >= MOST_KEPT:  # each crop may have voxels of its own size
                self._kept.clear()
            self._kept[name, grid.voxel_size] = made_from, sampled
        return sampled
