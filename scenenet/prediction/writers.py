"""Files of a prediction: the classified survey (LAZ), the tower list (GeoJSON), the summary."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.files import write_json
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import SurveyTower
from scenenet.pointcloud import add_dimensions
from scenenet.prediction.predict import SurveyPrediction, predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.summary import PredictionSummary

if TYPE_CHECKING:
    import pyproj

PROBABILITY = "tower_probability"
TOWER_ID = "tower_id"
SHARE_PREFIX = "share_"


def predict_to_files(
    survey: str | Path,
    model: str | Path,
    out_laz: str | Path,
    out_geojson: str | Path,
    out_summary: str | Path,
    settings: PredictSettings,
    detection: DetectionSettings,
) -> PredictionSummary:
    """Predict a survey and write the classified points, the tower list and the summary.

    The survey is read twice: once for its occupied voxels, once to write every point back.

    Args:
        survey: LAS, LAZ, COPC or TS40K sample.
        model: model file with tau.
        out_laz: see ``write_points``.
        out_geojson: see ``tower_collection``.
        out_summary: ``PredictionSummary`` as JSON.

    Raises:
        InputError: the survey or the model cannot be used.
    """
    with predict_survey(survey, model, settings, detection) as prediction:
        write_points(prediction, out_laz)
        write_json(out_geojson, tower_collection(prediction.towers, prediction.crs))
        summary = summarise(prediction)
    write_json(out_summary, summary.to_json())
    return summary


def point_dimensions(geneos: Iterable[str]) -> dict[str, tuple[type, str]]:
    """The extra dimensions of a classified survey: name -> (numpy type, description)."""
    dimensions: dict[str, tuple[type, str]] = {
        PROBABILITY: (np.float32, "probability of a tower"),
        TOWER_ID: (np.uint32, "tower number, 0 none"),
    }
    shares = {f"{SHARE_PREFIX}{geneo}": (np.float32, "share in the answer") for geneo in geneos}
    return dimensions | shares


def write_points(prediction: SurveyPrediction, out: str | Path) -> None:
    """Write every point of the survey back, in order, with ``point_dimensions`` added.

    Raises:
        InputError: the survey changed after it was read.
    """

    def values(xyz: np.ndarray) -> dict[str, np.ndarray]:
        points = prediction.look_up(xyz)
        shares = zip(prediction.geneos, points.shares.T, strict=True)
        named = {f"{SHARE_PREFIX}{geneo}": share for geneo, share in shares}
        return {PROBABILITY: points.probability, TOWER_ID: points.tower_id} | named

    dimensions = point_dimensions(prediction.geneos)
    written = add_dimensions(prediction.survey, out, dimensions, values)
    if written != prediction.n_points:
        Path(out).unlink()
        raise InputError(
            f"the first pass read {prediction.n_points} points, the second pass {written}",
            file=prediction.survey,
            remedy="The file changed in between; predict it again when no program writes to it",
        )


def tower_collection(towers: Iterable[SurveyTower], crs: pyproj.CRS | None) -> dict[str, Any]:
    """The tower list as a GeoJSON feature collection in the CRS of the survey."""
    features = [tower.to_feature() for tower in towers]
    collection: dict[str, Any] = {"type": "FeatureCollection", "features": features}
    if crs is not None:
        epsg = crs.to_epsg()
        crs_name = f"urn:ogc:def:crs:EPSG::{epsg}" if epsg else crs.to_string()
        collection["crs"] = {"type": "name", "properties": {"name": crs_name}}
    return collection


def summarise(prediction: SurveyPrediction) -> PredictionSummary:
    """The summary of a prediction; ``seconds`` counts up to this call."""
    detection = {"detection": prediction.detection.model_dump()}
    crs = prediction.crs
    return PredictionSummary(
        survey=str(prediction.survey),
        model=prediction.card.name,
        points=prediction.n_points,
        towers=len(prediction.towers),
        tau=prediction.card.threshold(),
        voxel_size_m=prediction.voxel_size,
        kernel_size=list(prediction.model.kernel_size),
        tiles=prediction.n_tiles,
        crs=None if crs is None else crs.to_string(),
        seconds=time.perf_counter() - prediction.started,
        settings=prediction.settings.model_dump() | detection,
        model_provenance=prediction.card.provenance,
    )
