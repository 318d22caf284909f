"""Voxel samples combined into batches for a model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenenet.convolution.occupancy import Occupancy
from scenenet.dataset.voxels import VoxelSample
from scenenet.measurement.registry import PRESENCE


def batch(samples: Sequence[VoxelSample], measurement: str) -> tuple[Occupancy, np.ndarray]:
    """Samples as one batch, on the smallest shape that contains all their grids.

    Smaller grids (fit metric) are padded with empty voxels at the upper end of each axis.

    Returns:
        the batch, and (T,) int64 flat positions of the tower voxels in a (B, D, H, W) volume.
    """
    shape = tuple(np.max([s.grid.shape for s in samples], axis=0).tolist())
    indices = [_into_shape(s.index, s.grid.shape, shape) for s in samples]
    volume = int(np.prod(shape))
    towers = [
        b * volume + i[s.labelled] for b, (s, i) in enumerate(zip(samples, indices, strict=True))
    ]
    phi = None if measurement == PRESENCE else [s.phi(measurement) for s in samples]
    occupancy = Occupancy.of_grids(indices, phi, shape)
    return occupancy, np.concatenate([*towers, np.empty(0, np.int64)]).astype(np.int64)


def _into_shape(
    index: np.ndarray, shape: tuple[int, int, int], larger: tuple[int, int, int]
) -> np.ndarray:
    if shape == larger:
        return index.astype(np.int64)
    return np.ravel_multi_index(np.unravel_index(index, shape), larger).astype(np.int64)
