"""Point clouds: reading them safely, writing them, and checking them.

- ``cloud``: the point cloud that every stage works with.
- ``class_schemes``: what class codes mean.
- ``targets``: what an observer finds, as a name and class codes.
- ``reading``: surveys of any format, whole or in chunks.
- ``true_classes``: true classes from a second file with the same points.
- ``file_kinds``: the kind of a file, from its content and suffix.
- ``las``: LAS, LAZ and COPC files.
- ``ts40k``: samples of the TS40K dataset.
- ``append_dimensions``: a copy of a survey with further dimensions.
- ``copc``: LAZ files as COPC, with PDAL.
- ``quality``: the content of a survey and its defects (``scenenet check``).
"""

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
