"""Files of a prediction: the classified survey (LAZ), the tower list, the summary."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from scenenet.core.errors import InputError, warn
from scenenet.core.files import atomic, read_json, write_json
from scenenet.core.outputs import Output, check_space
from scenenet.core.provenance import fingerprint
from scenenet.core.scratch import temporary_directory
from scenenet.detection.settings import DetectionSettings
from scenenet.pointcloud import add_dimensions
from scenenet.prediction.predict import SCRATCH_BYTES, SurveyPrediction, predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.summary import PredictionSummary
from scenenet.prediction.tower_lists import write_csv, write_geojson, write_geopackage

PROBABILITY = "tower_probability"
TOWER_ID = "tower_id"
TOWER_CODE = 15
"""Class code of a tower in the schemes asprs and edp."""
SHARE_PREFIX = "share_"


RESULT_BYTES = 12
"""Bytes that a point takes in the result, beyond those in the survey. Most measured on airborne and
mobile surveys: 11.4."""


@dataclass(frozen=True)
class PredictionFiles:
    """The files of a prediction.

    Attributes:
        points: the survey with the dimensions of ``point_dimensions`` (LAZ).
        geopackage, geojson, table: the tower list (``scenenet.prediction.tower_lists``).
        summary: ``PredictionSummary`` (JSON).
    """

    points: Path
    geopackage: Path
    geojson: Path
    table: Path
    summary: Path

    @classmethod
    def of(cls, survey: Path, folder: Path) -> PredictionFiles:
        """The files that the command line writes for a survey; ``.copc`` is not part of a name."""
        stem = survey.stem.removesuffix(".copc")
        endings = (".laz", ".gpkg", ".towers.geojson", ".towers.csv", ".summary.json")
        return cls(*(folder / f"{stem}{ending}" for ending in endings))

    @classmethod
    def names(cls) -> list[str]:
        """Names of the files."""
        return [field.name for field in fields(cls)]

    def outputs(self, survey: Path) -> list[Output]:
        return [Output(getattr(self, name), self.is_own, survey) for name in self.names()]

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
        atomic(files.geopackage) as geopackage,
        atomic(files.geojson) as geojson,
        atomic(files.table) as table,
        atomic(files.summary) as record,
    ):
        warn(survey, prediction.warnings)
        write_points(prediction, points)
        write_towers(prediction, geopackage, geojson, table)
        written = (points, geopackage, geojson, table)
        outputs = {path.name: fingerprint(path) for path in written}
        summary = summarise(prediction, outputs)
        write_json(record, summary.to_json())
    return summary


def write_towers(
    prediction: SurveyPrediction, geopackage: Path, geojson: Path, table: Path
) -> None:
    """Write the tower list in each of its formats."""
    towers, geneos, crs = prediction.towers, prediction.geneos, prediction.crs
    status = {
        "file": prediction.survey.name,
        "points": prediction.n_points,
        "towers": len(towers),
        "status": "predicted",
    }
    write_geopackage(geopackage, towers, geneos, crs, prediction.tiles.spool, status)
    write_geojson(geojson, towers, crs)
    write_csv(table, towers, geneos)


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

    def classify(dimensions: Mapping[str, np.ndarray], codes: np.ndarray) -> np.ndarray:
        chosen = prediction.settings.classify_from
        tower = dimensions[TOWER_ID] > 0
        if chosen is not None:
            tower &= np.isin(codes, chosen)
        return np.where(tower, TOWER_CODE, codes).astype(codes.dtype)

    dimensions = point_dimensions(prediction.geneos)
    reclassify = classify if prediction.settings.classify else None
    add_dimensions(prediction.survey, out, dimensions, values, prediction.state, reclassify)


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
