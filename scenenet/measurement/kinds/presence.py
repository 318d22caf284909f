"""Whether there is a point (thesis 4.2.2)."""

import numpy as np

from scenenet.measurement.measurement import MeasuredVoxels, Measurement
from scenenet.measurement.registry import PRESENCE, register


@register
class Presence(Measurement):
    """phi = 1."""

    name = PRESENCE

    def of_voxels(self, voxels: MeasuredVoxels) -> np.ndarray:
        return np.ones(len(voxels.count))
