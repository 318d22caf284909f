"""A whole survey, seamless: tiles with halo, then towers, then every point back."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.files import write_json
from scenenet.core.progress import track
from scenenet.detection.settings import DetectionSettings
from scenenet.pointcloud import add_dimensions, iter_chunks, survey_in_metres
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.tile_answers import TileAnswers
from scenenet.prediction.tiling import TileSpool
from scenenet.prediction.tower_map import geojson


def predict_survey(
    path: str | Path,
    model: str | Path,
    out_laz: str | Path,
    out_geojson: str | Path,
    out_summary: str | Path,
    settings: PredictSettings,
    detection: DetectionSettings,
) -> dict[str, Any]:
    """Classify a survey and list its towers.

    Memory is bounded by a chunk of points and a tile of voxels. The survey is read twice: once to
    learn which voxels are occupied, once to give every point its answer.

    Args:
        path: LAS, LAZ, COPC or TS40K sample.
        model: model file with tau.
        out_laz: every input point, in order, with ``tower_probability``, ``tower_id`` and a
            ``share_GENEO`` for each GENEO.
        out_geojson: a point per tower.
        out_summary: counts, settings and times.

    Returns:
        the summary.

    Raises:
        InputError: the survey or the model cannot be used.
    """
    from scenenet.models.geneo_model import GeneoModel
    from scenenet.models.model_file import read_model

    begin = time.perf_counter()
    trained, card = read_model(model)
    tau = card.threshold()  # before the work: a model without one cannot say what a tower is
    geneos = trained.names if isinstance(trained, GeneoModel) else []
    voxel_size = trained.observed_size(settings.voxel_size or card.voxel_size)
    name, crs = Path(path).name, survey_in_metres(path).crs
    with tempfile.TemporaryDirectory(prefix="scenenet-") as scratch:
        spool = TileSpool(Path(scratch), voxel_size)
        n_points = 0
        chunks = iter_chunks(path, chunk_points=settings.chunk_points)
        for chunk in track(chunks, f"{name}: chunks read"):
            spool.add(chunk.xyz)
            n_points += len(chunk)
        answers = TileAnswers(spool, Path(scratch), len(geneos))
        answers.compute(trained, card, f"{name}: tiles predicted")
        towers = answers.find_towers(tau, detection)
        _write_points(path, out_laz, answers, geneos, n_points)
    write_json(out_geojson, geojson(towers, geneos, crs))
    summary = {
        "survey": str(path),
        "model": card.name,
        "points": n_points,
        "towers": len(towers),
        "tau": tau,
        "voxel_size_m": voxel_size,
        "kernel_size": list(trained.kernel_size),
        "tiles": len(spool),
        "crs": None if crs is None else crs.to_string(),
        "seconds": time.perf_counter() - begin,
        "settings": settings.model_dump() | {"detection": detection.model_dump()},
        "model_provenance": card.provenance,
    }
    write_json(out_summary, summary)
    return summary


def _write_points(
    path: str | Path, out_laz: str | Path, answers: TileAnswers, geneos: list[str], n_points: int
) -> None:
    """Every point back, with its answer.

    Raises:
        InputError: the survey has not the number of points any more that it had when it was read.
    """
    dimensions: dict[str, tuple[type, str]] = {
        "tower_probability": (np.float32, "probability of a tower"),
        "tower_id": (np.uint32, "tower number, 0 none"),
    }
    dimensions |= {f"share_{geneo}": (np.float32, "share in the answer") for geneo in geneos}
    written = add_dimensions(path, out_laz, dimensions, lambda xyz: answers.of_points(xyz, geneos))
    if written != n_points:
        Path(out_laz).unlink()
        raise InputError(
            f"{n_points} points were read at first and {written} when writing",
            file=path,
            remedy="The file changed meanwhile; run again when nothing writes to it",
        )
