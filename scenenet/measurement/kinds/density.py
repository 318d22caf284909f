"""How many points there are (thesis 5.3.2)."""

import numpy as np

from scenenet.measurement.measurement import MeasuredVoxels, Measurement
from scenenet.measurement.registry import register


@register
class Density(Measurement):
    """phi = number of points / that of the fullest voxel."""

    name = "density"
    needs = frozenset({"fullest"})

    def of_voxels(self, voxels: MeasuredVoxels) -> np.ndarray:
        assert voxels.fullest is not None
        return voxels.count / voxels.fullest
