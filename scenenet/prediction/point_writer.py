"""Writes the points of a survey back, each with what was predicted for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.pointcloud import add_dimensions
from scenenet.pointcloud.targets import TOWER
from scenenet.prediction.file_status import SurveyFile
from scenenet.prediction.point_dimensions import (
    CONDUCTOR_ID,
    LINE_DIMENSIONS,
    SPAN_ID,
    TOWER_ID,
    dimensions_of,
    probability_of,
    share_of,
)
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.work.point_predictions import PointLookUp

if TYPE_CHECKING:
    import pyproj


def write_points(
    file: SurveyFile,
    look_up: PointLookUp,
    out: str | Path,
    settings: PredictSettings,
    crs: pyproj.CRS | None,
) -> SurveyFile:
    """Write every point of a file back, in order, with the dimensions of each model added.

    Args:
        file: as it was read.
        look_up: says what was predicted for a point.
        out: LAZ file to write.
        crs: written if the file has no record of a system at all; None if it is not known.

    Returns:
        the file, with the numbers of its towers and of the points taken for each target.

    Raises:
        InputError: the file changed after it was read; ``out`` stays as it was.
    """
    models = look_up.models
    counts = {model.target.name: 0 for model in models}
    towers: set[int] = set()
    taken: dict[str, np.ndarray] = {}

    def values(xyz: np.ndarray) -> dict[str, np.ndarray]:
        points = look_up(xyz)
        towers.update(np.unique(points.tower_id[points.tower_id > 0]).tolist())
        named = {}
        for number, (model, predicted) in enumerate(zip(models, points.models, strict=True)):
            target = model.target
            taken[target.name] = look_up.taken(points, number)
            counts[target.name] += int(np.count_nonzero(taken[target.name]))
            named[probability_of(target)] = predicted.probability
            if target.is_tower:
                named[TOWER_ID] = points.tower_id
            for geneo, share in zip(model.tiles.geneos, predicted.shares.T, strict=True):
                named[share_of(target, geneo)] = share
        if points.span_id is not None and points.conductor_id is not None:
            named |= {SPAN_ID: points.span_id, CONDUCTOR_ID: points.conductor_id}
        return named

    def classify(_: Mapping[str, np.ndarray], codes: np.ndarray) -> np.ndarray:
        written, free = codes, np.ones(len(codes), bool)
        if settings.classify_from is not None:
            free &= np.isin(codes, settings.classify_from)
        for model in models:  # that of towers is the first, and its points are of nothing else
            if model.code is not None:
                own = taken[model.target.name]
                written = np.where(free & own, model.code, written).astype(codes.dtype)
                free &= ~own
        return written

    dimensions: dict[str, tuple[type, str]] = {}
    for model in models:
        dimensions |= dimensions_of(model.target, model.tiles.geneos)
    if look_up.has_line:
        dimensions |= LINE_DIMENSIONS
    reclassify = classify if settings.classify else None
    add_dimensions(file.path, out, dimensions, values, file.state, reclassify, crs)
    tower_points = counts.pop(TOWER.name, 0)
    return replace(file, towers=len(towers), tower_points=tower_points, target_points=counts)
