"""How strongly the points reflect."""

import numpy as np

from scenenet.measurement.measurement import Measurement
from scenenet.measurement.registry import register
from scenenet.pointcloud.point_fields import PointFields

LARGEST = 65535
"""The intensity that counts as 1: the largest that LAS can store. LAS 1.4 asks producers to use the
whole range."""


@register
class Intensity(Measurement):
    """phi = mean intensity of the points / 65535."""

    name = "intensity"
    needs = frozenset({"intensity"})

    def of_points(self, points: PointFields) -> np.ndarray:
        assert points.intensity is not None
        return points.intensity / LARGEST
