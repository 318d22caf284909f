"""Coarsening of fine grids to blocks of about a metre, for models in metres.

A survey has a few points per square metre on a tower. In voxels much smaller than a metre the body
of a tower becomes a set of single points, and a kernel measures the density of the survey instead
of the tower. A model in metres therefore observes a fine grid in blocks of about ``OBSERVED_M``,
and each voxel takes the response of its block.
"""

from __future__ import annotations

import numpy as np

from scenenet.convolution.occupancy import Occupancy

OBSERVED_M = 1.0
"""Edge of the blocks, m: about the voxel size of a 64^3 grid over a crop of two tower heights."""


def block_edge(voxel_size: float, observed: float = OBSERVED_M) -> int:
    """Voxels per edge of the block whose size is nearest to ``observed`` m; at least 1."""
    return max(1, round(observed / voxel_size))


def coarsened(occupancy: Occupancy, edge: int) -> tuple[Occupancy, np.ndarray]:
    """The grids in blocks of ``edge`` voxels, and the block of each voxel.

    A block is occupied if any of its voxels is, and takes the largest of their values.

    Returns:
        the coarse grids, whose last blocks may extend beyond the high sides, and for each voxel of
        ``occupancy`` the row (M,) int64 of its block in their ``index``.
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
