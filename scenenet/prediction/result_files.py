"""Where the results of a prediction go, and the space that they take."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from scenenet.core.errors import InputError
from scenenet.core.files import read_json
from scenenet.core.outputs import Output, check_space
from scenenet.core.provenance import fingerprint
from scenenet.core.scratch import temporary_directory
from scenenet.pointcloud.copc import SUFFIX
from scenenet.prediction.page.survey_page import PAGE_BYTES
from scenenet.prediction.predict import scratch_bytes
from scenenet.prediction.summary import SUMMARY
from scenenet.prediction.survey_files import SurveyFiles, result_name
from scenenet.prediction.work.work_folder import WorkFolder

RESULT_BYTES = 12
"""Bytes that a point takes in the result, beyond those in the survey. Most measured on airborne and
mobile surveys: 11.4."""


LINE_TABLES = (".spans.csv", ".conductors.csv", ".clearances.csv")
"""What follows the name of the survey in the names of the tables of its lines."""


@dataclass(frozen=True)
class PredictionFiles:
    """The files of a prediction.

    Attributes:
        points: file of the survey -> the same points with the dimensions of ``point_dimensions``
            (LAZ).
        geopackage, geojson, table: the tower list (``scenenet.prediction.tower_lists``); the last
            two are None where no towers are looked for, and the GeoPackage has its other layers.
        summary: ``PredictionSummary`` (JSON).
        page: the page of the survey (HTML); None for no page.
        status: a row per file of the survey (CSV); None for a survey that is one file.
        copc: whether each file of the points is also written as COPC (``copc_of``).
        line_tables: the spans, the conductors and the clearances (CSV); None where no lines are
            looked for.
    """

    points: Mapping[Path, Path]
    geopackage: Path
    geojson: Path | None
    table: Path | None
    summary: Path
    page: Path | None = None
    status: Path | None = None
    copc: bool = False
    line_tables: tuple[Path, Path, Path] | None = None

    @classmethod
    def of(
        cls,
        survey: SurveyFiles | Path,
        folder: Path,
        *,
        copc: bool = False,
        towers: bool = True,
        line: bool = False,
    ) -> PredictionFiles:
        """The files that the command line writes for a survey. The points of one with several files
        are in a folder with its name, with its status.

        Args:
            copc: whether points are also written as COPC.
            towers: whether towers are looked for.
            line: whether lines are looked for.
        """
        if not isinstance(survey, SurveyFiles):
            survey = SurveyFiles.of(survey)
        place = folder / survey.name if survey.tiled else folder
        points = {
            path: place / f"{result_name(name)}.laz"
            for path, name in survey.names.items()
            if path not in survey.refused
        }
        return cls(
            points,
            geopackage=folder / f"{survey.name}.gpkg",
            geojson=folder / f"{survey.name}.towers.geojson" if towers else None,
            table=folder / f"{survey.name}.towers.csv" if towers else None,
            summary=folder / f"{survey.name}{SUMMARY}",
            page=folder / f"{survey.name}.html" if towers else None,
            status=place / "status.csv" if survey.tiled else None,
            copc=copc,
            line_tables=tuple(folder / (survey.name + end) for end in LINE_TABLES)  # type: ignore[arg-type]
            if line
            else None,
        )

    @property
    def lists(self) -> tuple[Path, ...]:
        """The tower list in its formats, the page, and the status."""
        tables = self.line_tables or ()
        named = (self.geopackage, self.geojson, self.table, self.page, self.status, *tables)
        return tuple(path for path in named if path is not None)

    def outputs(self) -> list[Output]:
        lists = [Output(path, self.is_own) for path in (*self.lists, self.summary)]
        points = [Output(path, self.is_own, file) for file, path in self.points.items()]
        if self.copc:
            points += [
                Output(copc_of(path), self.is_own, file) for file, path in self.points.items()
            ]
        return points + lists

    def outdated(self) -> list[Path]:
        """Lists and pages that an earlier prediction wrote and this one does not."""
        endings: tuple[str, ...] = ()
        if self.table is None:
            endings += (".towers.geojson", ".towers.csv", ".html")
        if self.line_tables is None:
            endings += LINE_TABLES
        name = self.summary.name.removesuffix(SUMMARY)
        paths = (self.summary.with_name(name + ending) for ending in endings)
        return [path for path in paths if path.exists() and self.is_own(path)]

    def is_own(self, path: Path) -> bool:
        """Whether ``path`` is as an earlier prediction wrote it; its summary is the record, and
        until that is written, the record of the points."""
        try:
            if path == self.summary:
                return isinstance(read_json(self.summary)["outputs"], dict)
            found = fingerprint(path)
            return any(known.get(self.key(path)) == found for known in self._recorded())
        except (InputError, AttributeError, KeyError, OSError, TypeError, ValueError):
            return False

    def key(self, path: Path) -> str:
        """Name of an output in the record: its path from the folder of the summary."""
        return path.relative_to(self.summary.parent).as_posix()

    @property
    def unfinished(self) -> Path:
        """Record of the points that were written or are about to be, while the others are not."""
        return self.summary.with_name(f".{self.summary.name}.unfinished")

    @property
    def work(self) -> Path | None:
        """Folder for what a run that is stopped leaves for the next one; None for a survey that is
        one file, which begins again."""
        if self.status is None:
            return None
        return self.summary.with_name(f".{self.summary.name.removesuffix(SUMMARY)}.work")

    def _recorded(self) -> Iterator[dict[str, str]]:
        """The fingerprints of what a finished prediction wrote, and of what one that was stopped
        wrote or was about to write."""
        if self.summary.exists():
            yield read_json(self.summary)["outputs"]
        if self.unfinished.exists():
            yield read_json(self.unfinished)


def copc_of(points: Path) -> Path:
    """The COPC file of a file of points."""
    return points.with_suffix(SUFFIX)


def require_space(
    surveys: Sequence[tuple[PredictionFiles, Mapping[Path, int]]], n_models: int = 1
) -> None:
    """Check that the disks have room for all results, and for the temporary files of one survey.

    Args:
        surveys: for each survey, its results, and its files with the number of points of each.
        n_models: number of models.

    Raises:
        OutputError: a disk has too little space.
    """
    needs: dict[Path, int] = {}
    scratch: dict[Path, int] = {}
    for files, points in surveys:
        size = sum(path.stat().st_size + RESULT_BYTES * n_models * n for path, n in points.items())
        page = 0 if files.page is None else PAGE_BYTES
        out = files.summary.parent
        there = sum(path.stat().st_size for path in files.points.values() if path.exists())
        needs[out] = needs.get(out, 0) + max(page, size * (2 if files.copc else 1) + page - there)
        place, kept = temporary_directory(), 0
        if files.work is not None:
            place, kept = out, WorkFolder(files.work).bytes_kept()
        left = max(0, scratch_bytes(n_models) * sum(points.values()) - kept)
        scratch[place] = max(scratch.get(place, 0), left)
    both = [*needs, *(place for place in scratch if place not in needs)]
    check_space({path: needs.get(path, 0) + scratch.get(path, 0) for path in both})
