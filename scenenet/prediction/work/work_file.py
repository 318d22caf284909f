"""The work file of a survey file: its voxels and its points, as the later stages need them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError, OutputError, in_file
from scenenet.core.files import atomic
from scenenet.core.progress import track
from scenenet.core.provenance import is_still
from scenenet.core.unchanged import FileState, unchanged
from scenenet.measurement.registry import measurement_named
from scenenet.pointcloud import PointCloud, iter_chunks
from scenenet.pointcloud.quality.screening import Screening
from scenenet.pointcloud.reading import SurveyInfo, survey_of_lengths
from scenenet.prediction.file_status import SurveyFile
from scenenet.prediction.work.block_file import BlockFile, BlockWriter
from scenenet.prediction.work.lattice import Lattice
from scenenet.prediction.work.survey_system import SurveySystem, in_metres
from scenenet.prediction.work.tiling import LOW_POINT, Layer, SpoolWriter, spooled_kinds

if TYPE_CHECKING:
    import pyproj


@dataclass(frozen=True)
class WorkFile:
    """What was read of a survey file.

    Attributes:
        file: the file, and why it cannot be used if it cannot. The points of a damaged file before
            its damage are there all the same, as surroundings of its neighbours.
        system: its coordinates; None if its header cannot be used.
        lattice: of its voxels.
        blocks: its voxels and points (``tiling.TileSpool`` reads them).
        known: fingerprint by which it was planned; None if it was not.
    """

    file: SurveyFile
    system: SurveySystem | None
    lattice: Lattice
    blocks: BlockFile
    known: str | None = None

    @classmethod
    def open(cls, path: str | Path) -> WorkFile:
        """A work file that ``read_file`` wrote.

        Raises:
            InputError: it cannot be read, or is damaged.
        """
        blocks = BlockFile(path)
        facts = blocks.facts
        system = facts["system"]
        return cls(
            SurveyFile.from_record(facts["file"]),
            None if system is None else SurveySystem.from_json(system),
            Lattice(facts["voxel_size"]),
            blocks,
            facts["known"],
        )


@dataclass(frozen=True)
class PlannedFile:
    """What is expected of a file when it is read.

    Attributes:
        known: its fingerprint; None if it could not be read.
        box: (x, y, x, y), lowest and highest, in its units, by which its neighbours were found;
            None without points.
    """

    known: str | None
    box: tuple[float, float, float, float] | None

    def require_same(self, path: Path) -> None:
        """Refuse a file that was replaced.

        Raises:
            InputError: the file is another one, or cannot be read.
        """
        if self.known is not None and not is_still(path, self.known):
            raise InputError(
                "the file was replaced while the workflow ran",
                file=path,
                remedy="Run the workflow again when no program writes to the file",
            )

    def require_inside(self, file: SurveyFile, info: SurveyInfo) -> None:
        """Refuse a file with points outside the box: not all of its neighbours know it.

        Raises:
            InputError: points lie outside, by more than a step of the stored coordinates.
        """
        if file.extent is None:
            return
        west, south, east, north = file.extent
        if self.box is None:
            away = float("inf")
        else:
            away = max(
                self.box[0] - west, self.box[1] - south, east - self.box[2], north - self.box[3]
            )
        if away > (max(info.scales[:2]) if info.scales else 0.0):
            raise InputError(
                f"points lie up to {away:.6g} {info.unit_names[0]} outside the bounding box of its "
                "header, from which the workflow finds the neighbours of a tile",
                file=file.path,
                remedy="Write its header again, for example with pdal translate or lasinfo "
                "-repair_bb",
            )


def read_file(
    path: Path,
    name: str,
    out: str | Path,
    voxel_size: float,
    chunk_points: int,
    crs: pyproj.CRS | None = None,
    planned: PlannedFile | None = None,
    further: Sequence[Layer] = (),
    *,
    classes: bool = False,
) -> SurveyFile:
    """Read a survey file into a work file. Memory is bounded by a chunk of points.

    A file that cannot be used gives a work file too, which says why.

    Args:
        path: LAS, LAZ, COPC or TS40K sample.
        name: of the file in the survey (``SurveyFiles.names``).
        out: work file to write.
        voxel_size: m, of the voxels that the model observes.
        chunk_points: points read at once.
        crs: system of a file that states none; None if it is not known.
        planned: what another process expects of the file; None if nothing was expected.
        further: further layers of voxels, for models that observe other ones.
        classes: whether the class codes of the points are kept, and of those that are withheld the
            class of noise.

    Raises:
        OutputError: the work file cannot be written.
    """
    with atomic(out) as partial, partial.open("wb") as stream:
        blocks, lattice = (
            BlockWriter(stream, spooled_kinds(further, classes=classes)),
            Lattice(voxel_size),
        )
        file, system = SurveyFile(path, name), None
        try:
            if planned is not None:
                planned.require_same(path)
            info = survey_of_lengths(path, crs)
            system = SurveySystem.of(info)
            spool = SpoolWriter(blocks, lattice, further)
            file = _read(path, info, spool, chunk_points, further, classes=classes)
            file = replace(file, name=name)
            if planned is not None:
                planned.require_inside(file, info)
        except OutputError:
            raise
        except InputError as error:
            file = replace(file, error=error)
        blocks.end({
            "file": file.to_record(),
            "system": None if system is None else system.to_json(),
            "voxel_size": voxel_size,
            "known": None if planned is None else planned.known,
        })  # fmt: skip
    return file


def _read(
    path: Path,
    info: SurveyInfo,
    spool: SpoolWriter,
    chunk_points: int,
    further: Iterable[Layer],
    *,
    classes: bool,
) -> SurveyFile:
    """Read a file into ``spool``, which has ``further`` layers, and look at it."""
    measurements = {
        layer.measurement: measurement_named(layer.measurement)
        for layer in further
        if layer.measurement
    }
    wanted = list(dict.fromkeys(f for measured in measurements.values() for f in measured.fields))
    screening, n_points, state = Screening(info, converted=True), 0, FileState.of(path)
    with unchanged(state), in_file(path):
        chunks = iter_chunks(path, chunk_points=chunk_points, fields=wanted)
        total = -(-info.n_points // chunk_points)
        for chunk in track(chunks, f"{path.name}: chunks read", total):
            screening.add(chunk.xyz, chunk.classification)
            steps = {}
            if chunk.fields is not None:
                steps = {name: m.point_steps(chunk.fields) for name, m in measurements.items()}
            codes = _codes(chunk) if classes else None
            spool.add(in_metres(chunk.xyz, info.unit_sizes), steps, codes)
            n_points += len(chunk)
    screening.raise_if_not_metres()
    extent = (*screening.mins[:2].tolist(), *screening.maxs[:2].tolist()) if n_points else None
    return SurveyFile(path, path.name, state, n_points, extent, warnings=screening.warnings())


def _codes(chunk: PointCloud) -> np.ndarray:
    """(n,) uint8 class codes, with that of noise for points that are not to be used."""
    if chunk.withheld is None:
        return chunk.classification
    return np.where(chunk.withheld, np.uint8(LOW_POINT), chunk.classification)
