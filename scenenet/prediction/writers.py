"""Files of a prediction: the classified survey (LAZ), the tower list, the summary."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scenenet.core.errors import InputError, OutputError
from scenenet.core.files import atomic, read_json, write_json
from scenenet.core.outputs import Output, check_space
from scenenet.core.provenance import fingerprint
from scenenet.core.scratch import temporary_directory
from scenenet.detection.settings import DetectionSettings
from scenenet.pointcloud import add_dimensions
from scenenet.pointcloud.copc import SUFFIX, write_copc
from scenenet.prediction.file_status import SurveyFile, write_status
from scenenet.prediction.page.survey_page import PAGE_BYTES, write_page
from scenenet.prediction.predict import SCRATCH_BYTES, SurveyPrediction, predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.summary import PredictionSummary
from scenenet.prediction.survey_files import SurveyFiles, result_stem
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
        points: file of the survey -> the same points with the dimensions of ``point_dimensions``
            (LAZ).
        geopackage, geojson, table: the tower list (``scenenet.prediction.tower_lists``).
        summary: ``PredictionSummary`` (JSON).
        page: the page of the survey (HTML); None for no page.
        status: a row per file of the survey (CSV); None for a survey that is one file.
        copc: whether each file of the points is also written as COPC (``copc_of``).
    """

    points: Mapping[Path, Path]
    geopackage: Path
    geojson: Path
    table: Path
    summary: Path
    page: Path | None = None
    status: Path | None = None
    copc: bool = False

    @classmethod
    def of(cls, survey: SurveyFiles | Path, folder: Path, *, copc: bool = False) -> PredictionFiles:
        """The files that the command line writes for a survey. The points of one with several files
        are in a folder with its name, with its status."""
        if not isinstance(survey, SurveyFiles):
            survey = SurveyFiles.of(survey)
        place = folder / survey.name if survey.tiled else folder
        points = {
            path: (place / name).with_name(f"{result_stem(path)}.laz")
            for path, name in survey.names.items()
            if path not in survey.refused
        }
        return cls(
            points,
            geopackage=folder / f"{survey.name}.gpkg",
            geojson=folder / f"{survey.name}.towers.geojson",
            table=folder / f"{survey.name}.towers.csv",
            summary=folder / f"{survey.name}.summary.json",
            page=folder / f"{survey.name}.html",
            status=place / "status.csv" if survey.tiled else None,
            copc=copc,
        )

    @property
    def lists(self) -> tuple[Path, ...]:
        """The tower list in its formats, the page, and the status."""
        named = (self.geopackage, self.geojson, self.table, self.page, self.status)
        return tuple(path for path in named if path is not None)

    def outputs(self) -> list[Output]:
        lists = [Output(path, self.is_own) for path in (*self.lists, self.summary)]
        points = [Output(path, self.is_own, file) for file, path in self.points.items()]
        if self.copc:
            points += [
                Output(copc_of(path), self.is_own, file) for file, path in self.points.items()
            ]
        return points + lists

    def is_own(self, path: Path) -> bool:
        """Whether ``path`` is as an earlier prediction wrote it; its summary is the record, and
        until that is written, the record of the points."""
        try:
            if path == self.summary:
                return isinstance(read_json(self.summary)["outputs"], dict)
            return bool(fingerprint(path) == self._recorded()[self.key(path)])
        except (InputError, KeyError, OSError, TypeError, ValueError):
            return False

    def key(self, path: Path) -> str:
        """Name of an output in the record: its path from the folder of the summary."""
        return path.relative_to(self.summary.parent).as_posix()

    @property
    def unfinished(self) -> Path:
        """Record of the points that were written, while the others are not."""
        return self.summary.with_name(f".{self.summary.name}.unfinished")

    def _recorded(self) -> dict[str, str]:
        written: dict[str, str] = {}
        if self.summary.exists():
            written |= read_json(self.summary)["outputs"]
        if self.unfinished.exists():
            written |= read_json(self.unfinished)
        return written


def copc_of(points: Path) -> Path:
    """The COPC file of a file of points."""
    return points.with_suffix(SUFFIX)


def require_space(surveys: Sequence[Mapping[Path, int]], out: Path, *, copc: bool = False) -> None:
    """Check that the disks have room for all results, and for the temporary files of one survey.

    Args:
        surveys: for each survey, its files with the number of points of each.
        out: folder of the results.
        copc: whether the points are written as COPC too.

    Raises:
        OutputError: a disk has too little space.
    """
    sizes = [(path.stat().st_size, points) for files in surveys for path, points in files.items()]
    results = sum(size + RESULT_BYTES * points for size, points in sizes) * (2 if copc else 1)
    results += PAGE_BYTES * len(surveys)
    scratch = SCRATCH_BYTES * max((sum(files.values()) for files in surveys), default=0)
    check_space({out: results, temporary_directory(): scratch})


def predict_to_files(
    survey: str | Path | SurveyFiles,
    model: str | Path,
    files: PredictionFiles,
    settings: PredictSettings,
    detection: DetectionSettings,
) -> PredictionSummary:
    """Predict a survey and write the classified points, the tower list and the summary.

    The survey is read twice: once for its occupied voxels, once to write every point back. Of a
    survey that is one file, all results appear, or none. Of one with several files, each file
    appears whole; one that fails stops no other and is named in the summary, in the layer ``tiles``
    and in the status.

    Args:
        survey: LAS, LAZ, COPC or TS40K sample; a folder, a pattern or a tile index of LAS and LAZ
            files.
        model: model file with tau.
        files: to write.

    Raises:
        InputError: the survey or the model cannot be used.
        OutputError: a file cannot be written.
    """
    with predict_survey(survey, model, settings, detection) as prediction, ExitStack() as stack:
        prediction.warn()
        written: dict[str, str] = {}
        if prediction.survey.tiled:
            read = _write_tiles(prediction, files, written)
        else:
            [(path, target)] = files.points.items()
            partial = stack.enter_context(atomic(target))
            read = (write_points(prediction, path, partial),)
            written[files.key(target)] = fingerprint(partial)
            if files.copc:
                copc = stack.enter_context(atomic(copc_of(target)))
                write_copc(partial, copc)
                written[files.key(copc_of(target))] = fingerprint(copc)
        lists = {path: stack.enter_context(atomic(path)) for path in files.lists}
        record = stack.enter_context(atomic(files.summary))
        prediction = replace(prediction, files=read)
        of_towers = (files.geopackage, files.geojson, files.table)
        write_towers(prediction, *(lists[path] for path in of_towers))
        if files.page is not None:
            write_page(prediction, lists[files.page])
        if files.status is not None:
            write_status(lists[files.status], prediction.files)
        written |= {files.key(path): fingerprint(partial) for path, partial in lists.items()}
        summary = summarise(prediction, written)
        write_json(record, summary.to_json())
    files.unfinished.unlink(missing_ok=True)
    return summary


def _write_tiles(
    prediction: SurveyPrediction, files: PredictionFiles, written: dict[str, str]
) -> tuple[SurveyFile, ...]:
    """Write the points of each file that was read, and the fingerprint of each into ``written``."""
    read = []
    for file in prediction.files:
        if file.error is None:
            target = files.points[file.path]
            try:
                with atomic(target) as partial:
                    file = write_points(prediction, file.path, partial)
                    written[files.key(target)] = fingerprint(partial)
                write_json(files.unfinished, written)
                if files.copc:
                    write_copc(target, copc_of(target))
                    written[files.key(copc_of(target))] = fingerprint(copc_of(target))
                    write_json(files.unfinished, written)
            except OutputError:
                raise
            except InputError as error:
                file = replace(file, error=error)
        read.append(file)
    return tuple(read)


def write_towers(
    prediction: SurveyPrediction, geopackage: Path, geojson: Path, table: Path
) -> None:
    """Write the tower list in each of its formats."""
    towers, geneos = prediction.towers, prediction.geneos
    crs, sizes = prediction.crs, prediction.unit_sizes
    spool, files = prediction.tiles.spool, prediction.files
    write_geopackage(geopackage, towers, geneos, crs, sizes, spool, files)
    write_geojson(geojson, towers, crs, sizes)
    write_csv(table, towers, geneos)


def point_dimensions(geneos: Iterable[str]) -> dict[str, tuple[type, str]]:
    """The extra dimensions of a classified survey: name -> (numpy type, description)."""
    dimensions: dict[str, tuple[type, str]] = {
        PROBABILITY: (np.float32, "probability of a tower"),
        TOWER_ID: (np.uint32, "id of tower, 0 none"),
    }
    shares = {f"{SHARE_PREFIX}{geneo}": (np.float32, "share of the response") for geneo in geneos}
    return dimensions | shares


def write_points(prediction: SurveyPrediction, path: Path, out: str | Path) -> SurveyFile:
    """Write every point of a file back, in order, with ``point_dimensions`` added.

    Returns:
        the file, with the numbers of its towers and of the points that have a tower id.

    Raises:
        InputError: the file changed after it was read; ``out`` stays as it was.
    """
    [file] = [file for file in prediction.files if file.path == path]
    chosen, in_tower = prediction.settings.classify_from, 0
    towers: set[int] = set()

    def values(xyz: np.ndarray) -> dict[str, np.ndarray]:
        nonlocal in_tower
        points = prediction.look_up(xyz)
        in_tower += int(np.count_nonzero(points.tower_id))
        towers.update(np.unique(points.tower_id[points.tower_id > 0]).tolist())
        shares = zip(prediction.geneos, points.shares.T, strict=True)
        named = {f"{SHARE_PREFIX}{geneo}": share for geneo, share in shares}
        return {PROBABILITY: points.probability, TOWER_ID: points.tower_id} | named

    def classify(dimensions: Mapping[str, np.ndarray], codes: np.ndarray) -> np.ndarray:
        tower = dimensions[TOWER_ID] > 0
        if chosen is not None:
            tower &= np.isin(codes, chosen)
        return np.where(tower, TOWER_CODE, codes).astype(codes.dtype)

    dimensions = point_dimensions(prediction.geneos)
    reclassify = classify if prediction.settings.classify else None
    add_dimensions(path, out, dimensions, values, file.state, reclassify, prediction.survey.crs)
    return replace(file, towers=len(towers), tower_points=in_tower)


def summarise(prediction: SurveyPrediction, outputs: dict[str, str]) -> PredictionSummary:
    """The summary of a prediction with the files ``outputs``; ``seconds`` counts up to now."""
    detection = {"detection": prediction.detection.model_dump()}
    crs = prediction.crs
    return PredictionSummary(
        survey=str(prediction.survey.given),
        model=prediction.card.name,
        points=prediction.n_points,
        towers=len(prediction.towers),
        tau=prediction.card.threshold(),
        voxel_size_m=prediction.voxel_size,
        kernel_size=list(prediction.model.kernel_size),
        tiles=prediction.n_tiles,
        crs=None if crs is None else crs.to_string(),
        unit_sizes_m=list(prediction.unit_sizes),
        units=list(prediction.unit_names),
        warnings=[
            *prediction.survey.notes,
            *(text for file in prediction.files for text in file.warnings),
        ],
        files=[file.to_json() for file in prediction.files],
        seconds=time.perf_counter() - prediction.started,
        settings=prediction.settings.model_dump() | detection,
        model_provenance=prediction.card.provenance,
        outputs=outputs,
    )
