"""Writes the points of a survey back, each with what was predicted for it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.pointcloud import add_dimensions
from scenenet.prediction.file_status import SurveyFile
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.work.point_predictions import PointLookUp

if TYPE_CHECKING:
    import pyproj

PROBABILITY = "tower_probability"
TOWER_ID = "tower_id"
TOWER_CODE = 15
"""Class code of a tower in the schemes asprs and edp."""
SHARE_PREFIX = "share_"


def point_dimensions(geneos: Iterable[str]) -> dict[str, tuple[type, str]]:
    """The extra dimensions of a classified survey: name -> (numpy type, description)."""
    dimensions: dict[str, tuple[type, str]] = {
        PROBABILITY: (np.float32, "probability of a tower"),
        TOWER_ID: (np.uint32, "id of tower, 0 none"),
    }
    shares = {f"{SHARE_PREFIX}{geneo}": (np.float32, "share of the response") for geneo in geneos}
    return dimensions | shares


def write_points(
    file: SurveyFile,
    look_up: PointLookUp,
    out: str | Path,
    settings: PredictSettings,
    crs: pyproj.CRS | None,
) -> SurveyFile:
    """Write every point of a file back, in order, with ``point_dimensions`` added.

    Args:
        file: as it was read.
        look_up: says what was predicted for a point.
        out: LAZ file to write.
        crs: written if the file has no record of a system at all; None if it is not known.

    Returns:
        the file, with the numbers of its towers and of the points that have a tower id.

    Raises:
        InputError: the file changed after it was read; ``out`` stays as it was.
    """
    chosen, in_tower = settings.classify_from, 0
    towers: set[int] = set()

    def values(xyz: np.ndarray) -> dict[str, np.ndarray]:
        nonlocal in_tower
        points = look_up(xyz)
        in_tower += int(np.count_nonzero(points.tower_id))
        towers.update(np.unique(points.tower_id[points.tower_id > 0]).tolist())
        shares = zip(look_up.geneos, points.shares.T, strict=True)
        named = {f"{SHARE_PREFIX}{geneo}": share for geneo, share in shares}
        return {PROBABILITY: points.probability, TOWER_ID: points.tower_id} | named

    def classify(dimensions: Mapping[str, np.ndarray], codes: np.ndarray) -> np.ndarray:
        tower = dimensions[TOWER_ID] > 0
        if chosen is not None:
            tower &= np.isin(codes, chosen)
        return np.where(tower, TOWER_CODE, codes).astype(codes.dtype)

    dimensions = point_dimensions(look_up.geneos)
    reclassify = classify if settings.classify else None
    add_dimensions(file.path, out, dimensions, values, file.state, reclassify, crs)
    return replace(file, towers=len(towers), tower_points=in_tower)
