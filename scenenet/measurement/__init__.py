"""The measurement phi: what is known about a voxel, as a number from 0 to 1 (thesis 4.2.2)."""

from scenenet.measurement.measurement import MeasuredVoxels, Measurement
from scenenet.measurement.outside import measurement_of_file
from scenenet.measurement.registry import (
    MeasurementName,
    measurement_named,
    measurement_names,
    register,
)
from scenenet.pointcloud.point_fields import PointFields

__all__ = [
    "MeasuredVoxels",
    "Measurement",
    "MeasurementName",
    "PointFields",
    "measurement_named",
    "measurement_names",
    "measurement_of_file",
    "register",
]
