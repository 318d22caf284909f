"""A finer grid seen at the voxel size that a model in metres observes at.

A survey has a few points a square metre on a tower. In voxels much smaller than a metre its body
falls apart into single points, and what a kernel counts there is the density of the survey and not
the tower. So a model in metres observes a fine grid through blocks of voxels of about
``OBSERVED_M``, and a voxel has the answer of the block it lies in.
"""

from __future__ import annotations

import numpy as np

from scenenet.convolution.occupancy import Occupancy

OBSERVED_M = 1.0
"""Edge of the blocks, m: about the voxels of 64^3 over a crop of two tower heights."""


def block_edge(voxel_size: float) -> int:
    """Voxels an edge of the block that comes nearest to ``OBSERVED_M``; at least 1."""
    return max(1, round(OBSERVED_M / voxel_size))


def coarsened(occupancy: Occupancy, edge: int) -> tuple[Occupancy, np.ndarray]:
    """The grids in blocks of ``edge`` voxels, and the block of each voxel.

    A block is occupied where any of its voxels is, by the largest of their values.

    Returns:
        the coarse grids, whose last blocks may stick out over the high sides, and the row (M,)
        int64 in their ``index`` of each voxel of ``occupancy``.
    """
    if edge == 1:
        return occupancy, np.arange(len(occupancy.index))
    depth, height, width = (-(-side // edge) for side in occupancy.shape)
    z, y, x = np.unravel_index(occupancy.index, occupancy.shape)
    within = np.ravel_multi_index((z // edge, y // edge, x // edge), (depth, height, width))
    volume = depth * height * width
    grid = np.repeat(np.arange(len(occupancy)), np.diff(occupancy.offsets))
    blocks, rows = np.unique(within + grid * volume, return_inverse=True)
    offsets = np.searchsorted(blocks, np.arange(len(occupancy) + 1) * volume)
    values = None
    if occupancy.values is not None:
        values = np.zeros(len(blocks), occupancy.values.dtype)
        np.maximum.at(values, rows, occupancy.values)
    coarse = Occupancy(blocks % volume, values, offsets, (depth, height, width))
    return coarse, rows
