"""How high above the ground a voxel lies."""

import numpy as np

from scenenet.measurement.measurement import MeasuredVoxels, Measurement
from scenenet.measurement.registry import register

HIGHEST_M = 50.0
"""m above the ground from which phi is 1: that of most towers."""


@register
class Height(Measurement):
    """phi = height above the ground / 50 m, and 1 above that. Ground itself has 0."""

    name = "height"
    needs = frozenset({"height"})

    def of_voxels(self, voxels: MeasuredVoxels) -> np.ndarray:
        assert voxels.height is not None
        return np.minimum(voxels.height / HIGHEST_M, 1.0)
