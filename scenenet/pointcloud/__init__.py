"""Point clouds: what one is, reading and writing it safely, and checking what is in it."""

from __future__ import annotations

from scenenet.pointcloud.append_dimensions import add_dimensions
from scenenet.pointcloud.class_schemes import SCHEMES, ClassScheme, class_scheme
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.las.writing import write_las
from scenenet.pointcloud.quality import check
from scenenet.pointcloud.reading import SurveyInfo, iter_chunks, read, survey_in_metres, survey_info

__all__ = [
    "SCHEMES",
    "ClassScheme",
    "PointCloud",
    "SurveyInfo",
    "add_dimensions",
    "check",
    "class_scheme",
    "iter_chunks",
    "read",
    "survey_in_metres",
    "survey_info",
    "write_las",
]
