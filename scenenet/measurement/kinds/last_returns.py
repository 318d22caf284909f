"""Whether the beam ends here: low in crowns and at conductors, high on ground and roofs."""

import numpy as np

from scenenet.measurement.measurement import Measurement
from scenenet.measurement.registry import register
from scenenet.pointcloud.point_fields import PointFields


@register
class LastReturns(Measurement):
    """phi = share of the points that are the last return of their pulse."""

    name = "last_returns"
    needs = frozenset({"returns"})

    def of_points(self, points: PointFields) -> np.ndarray:
        return points.is_last.astype(float)
