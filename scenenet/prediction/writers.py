"""Files of a prediction: the classified survey (LAZ), the tower list (GeoJSON), the summary."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.core.errors import InputError, warn
from scenenet.core.files import atomic, read_json, write_json
from scenenet.core.outputs import Output, check_space
from scenenet.core.provenance import fingerprint
from scenenet.core.scratch import temporary_directory
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import SurveyTower
from scenenet.pointcloud import add_dimensions
from scenenet.prediction.predict import SCRATCH_BYTES, SurveyPrediction, predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.summary import PredictionSummary

if TYPE_CHECKING:
    import pyproj

PROBABILITY = "tower_probability"
TOWER_ID = "tower_id"
SHARE_PREFIX = "share_"


RESULT_BYTES = 12
"""Bytes that a point takes in the result, beyond those in the survey. Most measured on airborne and
mobile surveys: 11.4."""


@dataclass(frozen=True)
class PredictionFiles:
    """The files of a prediction.

    Attributes:
        points: the survey with the dimensions of ``point_dimensions`` (LAZ).
        towers: the tower list (GeoJSON).
        summary: ``PredictionSummary`` (JSON).
    """

    points: Path
    towers: Path
    summary: Path

    @classmethod
    def of(cls, survey: Path, folder: Path) -> PredictionFiles:
        """The files that the command line writes for a survey; ``.copc`` is not part of a name."""
        points = folder / f"{survey.stem.removesuffix('.copc')}.laz"
        return cls(
            points, points.with_suffix(".towers.geojson"), points.with_suffix(".summary.json")
        )

    def outputs(self, survey: Path) -> list[Output]:
        return [
            Output(path, self.is_own, survey) for path in (self.points, self.towers, self.summary)
        ]

    def is_own(self, path: Path) -> bool:
        """Whether ``path`` is as an earlier prediction wrote it; its summary is the record."""
        try:
            written = read_json(self.summary)["outputs"]
            if path == self.summary:
                return isinstance(written, dict)
            return bool(fingerprint(path) == written[path.name])
        except (InputError, KeyError, OSError, TypeError, ValueError):
            return False


def require_space(surveys: Mapping[Path, int], out: Path) -> None:
    """Check that the disks have room for all results, and for the temporary files of one survey.

    Args:
        surveys: their files, with the number of points of each.
        out: folder of the results.

    Raises:
        OutputError: a disk has too little space.
    """
    points = surveys.values()
    results = sum(path.stat().st_size for path in surveys) + RESULT_BYTES * sum(points)
    scratch = SCRATCH_BYTES * max(points, default=0)
    check_space({out: results, temporary_directory(): scratch})


def predict_to_files(
    survey: str | Path,
    model: str | Path,
    files: PredictionFiles,
    settings: PredictSettings,
    detection: DetectionSettings,
) -> PredictionSummary:
    """Predict a survey and write the classified points, the tower list and the summary.

    The survey is read twice: once for its occupied voxels, once to write every point back.

    Args:
        survey: LAS, LAZ, COPC or TS40K sample.
        model: model file with tau.
        files: to write; all of them appear, or none.

    Raises:
        InputError: the survey or the model cannot be used.
        OutputError: a file cannot be written.
    """
    with (
        predict_survey(survey, model, settings, detection) as prediction,
        atomic(files.points) as points,
        atomic(files.towers) as towers,
        atomic(files.summary) as record,
    ):
        warn(survey, prediction.warnings)
        write_points(prediction, points)
        write_json(towers, tower_collection(prediction.towers, prediction.crs))
        outputs = {
            files.points.name: fingerprint(points),
            files.towers.name: fingerprint(towers),
        }
        summary = summarise(prediction, outputs)
        write_json(record, summary.to_json())
    return summary


def point_dimensions(geneos: Iterable[str]) -> dict[str, tuple[type, str]]:
    """The extra dimensions of a classified survey: name -> (numpy type, description)."""
    dimensions: dict[str, tuple[type, str]] = {
        PROBABILITY: (np.float32, "probability of a tower"),
        TOWER_ID: (np.uint32, "tower number, 0 none"),
    }
    shares = {f"{SHARE_PREFIX}{geneo}": (np.float32, "share of the response") for geneo in geneos}
    return dimensions | shares


def write_points(prediction: SurveyPrediction, out: str | Path) -> None:
    """Write every point of the survey back, in order, with ``point_dimensions`` added.

    Raises:
        InputError: the survey changed after it was read; ``out`` stays as it was.
    """

    def values(xyz: np.ndarray) -> dict[str, np.ndarray]:
        points = prediction.look_up(xyz)
        shares = zip(prediction.geneos, points.shares.T, strict=True)
        named = {f"{SHARE_PREFIX}{geneo}": share for geneo, share in shares}
        return {PROBABILITY: points.probability, TOWER_ID: points.tower_id} | named

    dimensions = point_dimensions(prediction.geneos)
    add_dimensions(prediction.survey, out, dimensions, values, prediction.state)


def tower_collection(towers: Iterable[SurveyTower], crs: pyproj.CRS | None) -> dict[str, Any]:
    """The tower list as a GeoJSON feature collection in the CRS of the survey."""
    features = [tower.to_feature() for tower in towers]
    collection: dict[str, Any] = {"type": "FeatureCollection", "features": features}
    if crs is not None:
        epsg = crs.to_epsg()
        crs_name = f"urn:ogc:def:crs:EPSG::{epsg}" if epsg else crs.to_string()
        collection["crs"] = {"type": "name", "properties": {"name": crs_name}}
    return collection


def summarise(prediction: SurveyPrediction, outputs: dict[str, str]) -> PredictionSummary:
    """The summary of a prediction with the files ``outputs``; ``seconds`` counts up to now."""
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
        warnings=list(prediction.warnings),
        seconds=time.perf_counter() - prediction.started,
        settings=prediction.settings.model_dump() | detection,
        model_provenance=prediction.card.provenance,
        outputs=outputs,
    )
