"""Write the files of a synthetic survey while the corridor is generated."""

from __future__ import annotations

import contextlib
import os
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.core.files import write_json
from scenenet.core.outputs import check_space
from scenenet.core.progress import track
from scenenet.pointcloud.las.writing import las_stream
from scenenet.synthetic.codes import TOWER
from scenenet.synthetic.corridor import Corridor, TrueTower, make_corridor
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.synthetic.survey_tiles import Write, tiled_stream

GENERATOR = "scenenet synth"
"""The generating software in the header of a synthetic survey."""

POINTS_PER_PULSE = 2.2
"""Points of a survey for each pulse of ``SyntheticSettings.density``; most measured: 2.03."""
POINT_BYTES = {".laz": 5, ".las": 30}
"""Bytes that a point takes; most measured in LAZ: 5.02."""


def make_survey(
    settings: SyntheticSettings,
    out: str | Path,
    truth: str | Path | None = None,
    towers: str | Path | None = None,
    progress: str | None = None,
    workers: int | None = None,
    tiles: int | None = None,
) -> dict[str, Any]:
    """Generate a corridor and write it as a survey, stretch by stretch.

    Args:
        settings: of the survey.
        out: LAS or LAZ file with the labels as annotated, ``edp`` codes; with ``tiles`` a folder.
        truth: the same points in the same order with the labels before annotation noise.
        towers: GeoJSON, a point per true tower: id, x, y, base, height, type.
        progress: label of the progress on stderr; None shows no progress.
        workers: threads; None for one per core. Their number does not change the files.
        tiles: number of files that the survey is cut into, across the line; ``out`` and ``truth``
            are then folders for them. None for one file.

    Returns:
        Counts: points, towers, length_m, classes (code -> points), and mislabelled: the share of
        mislabelled points among those labelled tower.

    Raises:
        InputError: a setting or path is invalid.
        OutputError: a file cannot be written, or a disk has too little space for it.
    """
    corridor = make_corridor(settings)
    surveys = [Path(path) for path in (out, truth) if path is not None]
    check_space({path: space_needed(corridor, path) for path in surveys})

    def one(path: Path) -> AbstractContextManager[Write]:
        return las_stream(path, corridor.crs, offsets, software=GENERATOR)

    def survey(path: Path) -> AbstractContextManager[Write]:
        return one(path) if tiles is None else tiled_stream(path, corridor, tiles, one)

    stretches = corridor.stretches(workers or len(os.sched_getaffinity(0)))
    if progress is not None:
        stretches = track(stretches, f"{progress}: stretches made", total=len(corridor))
    counts = np.zeros(256, np.int64)
    wrong = 0
    # The line starts at the origin; a file with steps of 1 mm reaches 2000 km to each side of it.
    offsets = np.floor([settings.easting / 1000, settings.northing / 1000, 0.0]) * 1000
    with contextlib.ExitStack() as files:
        annotated = files.enter_context(survey(Path(out)))
        true = None if truth is None else files.enter_context(survey(Path(truth)))
        for stretch in stretches:
            annotated(stretch.xyz, stretch.labels)
            if true is not None:
                true(stretch.xyz, stretch.truth)
            counts += np.bincount(stretch.labels, minlength=256)
            wrong += int(((stretch.labels == TOWER) & (stretch.truth != TOWER)).sum())
    found = corridor.towers
    if towers is not None:
        write_json(towers, towers_geojson(found, settings.epsg))
    return {
        "points": int(counts.sum()),
        "towers": len(found),
        "length_m": round(corridor.length, 1),
        "classes": {int(code): int(counts[code]) for code in np.flatnonzero(counts)},
        "mislabelled": round(wrong / max(int(counts[TOWER]), 1), 4),
    }


def space_needed(corridor: Corridor, path: Path) -> int:
    """About how many bytes the survey of a corridor takes in the file ``path``."""
    pulses = corridor.length * 2 * corridor.settings.half_width * corridor.settings.density
    point = POINT_BYTES.get(path.suffix.lower() or ".laz", 0)
    return int(pulses * POINTS_PER_PULSE * point)


def is_synthetic_survey(path: Path) -> bool:
    """Whether the file is a survey that ``make_survey`` wrote, and not a prediction for one."""
    import laspy

    try:
        with laspy.open(path) as reader:
            header = reader.header
            dimensions = list(header.point_format.extra_dimension_names)
    except Exception:  # any fault of any file: it is not one of ours
        return False
    return header.generating_software.strip() == GENERATOR and not dimensions


def towers_geojson(towers: list[TrueTower], epsg: int) -> dict[str, Any]:
    """A GeoJSON feature collection with a point per tower; coordinates are in the CRS that it
    names."""
    features = []
    for tower in towers:
        properties = {
            "id": tower.id,
            "x": round(tower.x, 3),
            "y": round(tower.y, 3),
            "base": round(tower.base, 3),
            "height": round(tower.height, 3),
            "type": tower.type,
        }
        point = {"type": "Point", "coordinates": [properties["x"], properties["y"]]}
        features.append({"type": "Feature", "geometry": point, "properties": properties})
    crs = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{epsg}"}}
    return {"type": "FeatureCollection", "crs": crs, "features": features}
