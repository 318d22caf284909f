"""The maximum over the orbit of a kernel with a direction, beside single kernels."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import torch

from scenenet.bench.timing import medians
from scenenet.convolution.convolve import convolve_at_voxels
from scenenet.convolution.orbit import Orbit, strongest_at_voxels
from scenenet.dataset.batches import batch
from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.geneo import Lattice, kernel_named
from scenenet.pointcloud import PointCloud

VOXEL = 0.5
"""m, voxel size of the observer of conductors."""
SHAPES = {"line": {"l": 10.0, "r": 0.45}, "ground": {"r": 4.0, "h": 1.0}}
"""The lengths, m, of the kernels of this observer that have a direction."""


@torch.no_grad()
def orbits(crops: list[PointCloud], repetitions: int = 7) -> dict[str, Any]:
    """Time of each kernel of ``SHAPES`` at the occupied voxels of the first crop.

    Returns:
        by kernel: filled, share of positions that are not zero; ours_ms, the maximum over its
        orbit; by_position_ms, the same stored by position, whatever is faster; one_ms, one kernel
        of the orbit; one_full_ms, a kernel of the same size without zeros; each_ms, all kernels
        one after the other, extrapolated from one; difference, of the maximum from that of the
        single kernels.
    """
    grid = VoxelGrid.metric(crops[0].xyz, VOXEL)
    occupancy, _ = batch([voxelise(crops[0], grid, "0")], "presence")
    found = {}
    for name, shape in SHAPES.items():
        kernel = kernel_named(name)
        extent = kernel.extent(shape)
        assert extent is not None
        high, wide = (int(m / VOXEL) for m in (max(extent.up, extent.down), extent.around))
        lattice = Lattice.of_extent(
            (2 * high + 1, 2 * wide + 1, 2 * wide + 1), extent.around, VOXEL
        )
        numbers = {symbol: torch.tensor(value) for symbol, value in shape.items()}
        kernels = kernel.orbit(lattice, numbers)
        orbit, full = Orbit.of(kernels), torch.rand(kernels[:1].shape)
        by_position = Orbit.of(kernels, 1.0)
        times = medians(
            {
                "ours": partial(strongest_at_voxels, occupancy, orbit),
                "by_position": partial(strongest_at_voxels, occupancy, by_position),
                "one": partial(convolve_at_voxels, occupancy, kernels[:1]),
                "one_full": partial(convolve_at_voxels, occupancy, full),
            },
            repetitions,
        )
        some = slice(0, len(kernels), max(1, len(kernels) // 8))
        apart = convolve_at_voxels(occupancy, kernels[some]).max(dim=0).values.numpy()
        ours = strongest_at_voxels(occupancy, Orbit.of(kernels[some], 1.0))
        found[name] = {
            "kernels": len(kernels),
            "size": list(lattice.size),
            "filled": float((kernels != 0).float().mean()),
            "ours_ms": times["ours"],
            "by_position_ms": times["by_position"],
            "one_ms": times["one"],
            "one_full_ms": times["one_full"],
            "each_ms": times["one"] * len(kernels),
            "difference": float(np.abs(ours - apart).max()),
        }
    return found
