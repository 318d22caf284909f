"""All that was read of a survey: the work files of its files, as one survey."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from scenenet.prediction.file_status import SurveyFile, readable
from scenenet.prediction.survey_files import (
    SurveyFiles,
    in_other_system,
    nothing_to_use,
    system_of_survey,
)
from scenenet.prediction.work.lattice import Lattice
from scenenet.prediction.work.tiling import Layer, TileSpool
from scenenet.prediction.work.work_file import SurveySystem, WorkFile


@dataclass(frozen=True)
class SurveyWork:
    """The work files of a survey.

    Attributes:
        survey: its files, as they were named.
        files: its files in the same order, as they were read.
        used: the work files whose points are the survey; those of a damaged file are among them,
            as surroundings of its neighbours.
        system: the coordinates of the survey, those of the first file whose header can be used.
        spool: the voxels and points of all ``used``.
    """

    survey: SurveyFiles
    files: tuple[SurveyFile, ...]
    used: tuple[WorkFile, ...]
    system: SurveySystem
    spool: TileSpool

    @classmethod
    def open(cls, survey: SurveyFiles, reads: Mapping[Path, Path]) -> SurveyWork:
        """Open the work files.

        Args:
            reads: work file of each file of the survey that is not refused.

        Raises:
            InputError: no file can be used, or, of a survey that is one file, that one.
        """
        works = {path: WorkFile.open(out) for path, out in reads.items()}
        system = system_of_survey(
            (work.system, work.file.n_points) for work in works.values() if work.system is not None
        )
        names = survey.names
        files = tuple(
            _of_survey(works[path], system)
            if path in works
            else SurveyFile(path, names[path], error=survey.refused[path])
            for path in survey.files
        )
        errors = [file.error for file in files if file.error is not None]
        if errors and not survey.tiled:
            raise errors[0]
        if system is None or not any(readable(files)):
            raise nothing_to_use(survey, errors)
        used = tuple(belonging(works.values(), system))
        spool = TileSpool(used[0].lattice, (work.blocks for work in used))
        return cls(survey, files, used, system, spool)

    def spool_at(self, layer: Layer) -> TileSpool:
        """The voxels of another layer, of all ``used``; the files were read for it too
        (``read_file``)."""
        if layer == Layer(self.spool.voxel_size):
            return self.spool
        blocks = (work.blocks for work in self.used)
        return TileSpool(Lattice(layer.voxel_size), blocks, layer)


def belonging(works: Iterable[WorkFile], system: SurveySystem) -> Iterator[WorkFile]:
    """Those with the coordinates of a survey."""
    return (work for work in works if work.system is not None and work.system.is_same(system))


def _of_survey(work: WorkFile, system: SurveySystem | None) -> SurveyFile:
    """The file, left out if its coordinates are others than those of the survey."""
    if work.system is None or system is None or work.system.is_same(system):
        return work.file
    error = in_other_system(work.file.path, work.system, system, work.file.n_points)
    return SurveyFile(work.file.path, work.file.name, error=error)
