"""Point clouds: what one is, reading and writing it safely, and checking what is in it."""

from __future__ import annotations

from scenenet.pointcloud import check
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.extend import add_dimensions
from scenenet.pointcloud.schemes import SCHEMES, ClassScheme, class_scheme
from scenenet.pointcloud.survey import SurveyInfo, iter_chunks, read, survey_in_metres, survey_info
from scenenet.pointcloud.write import write_las

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
