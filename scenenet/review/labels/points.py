"""The points of a prediction, with the tower that each belongs to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.unchanged import FileState
from scenenet.pointcloud import survey_in_metres
from scenenet.pointcloud.append_dimensions import CHUNK_POINTS
from scenenet.pointcloud.las.header import read_header
from scenenet.pointcloud.las.records import class_codes, coordinates, iter_records
from scenenet.prediction.point_dimensions import TOWER_ID
from scenenet.review.found_list import FoundList


@dataclass(frozen=True)
class Points:
    """Consecutive points of a file.

    Attributes:
        xyz: (n, 3) m.
        codes: (n,) uint8 class codes.
        towers: (n,) id of the tower that was found at each point, 0 for none.
    """

    xyz: np.ndarray
    codes: np.ndarray
    towers: np.ndarray


def predicted_files(found: FoundList) -> dict[Path, str]:
    """The files with the points of a prediction, beside its list, and the name of each in the
    survey.

    Raises:
        InputError: there are none, or their coordinates are not in metres.
    """
    folder = found.path.parent
    single, tiles = folder / f"{found.name}.laz", folder / found.name
    files = {single: single.name} if single.is_file() else {}
    if not files and tiles.is_dir():
        there = sorted(path for path in tiles.rglob("*.laz") if not _is_copy(path))
        files = {path: path.relative_to(tiles).as_posix() for path in there}
    if not files:
        raise InputError(
            "the points of the prediction are not beside the list",
            file=found.path,
            remedy=f"Keep {single.name}, or the folder {found.name} with its tiles, in the folder "
            "of the list",
        )
    for path in files:
        if TOWER_ID not in survey_in_metres(path).extra_dimensions:
            raise InputError(
                f"its points have no dimension {TOWER_ID}",
                file=path,
                remedy="Predict the survey again",
            )
    return files


def _is_copy(path: Path) -> bool:
    """Whether a file of a prediction has the points of another one, ordered by place."""
    return path.name.endswith(".copc.laz")


def chunks_of(path: Path) -> Iterator[Points]:
    """The points of a file, in chunks of ``CHUNK_POINTS``.

    Raises:
        InputError: the file cannot be read.
    """
    for records in iter_records(read_header(path), CHUNK_POINTS):
        towers = np.asarray(records[TOWER_ID], np.int64)
        yield Points(coordinates(records), class_codes(records), towers)


def states_of(files: Mapping[Path, str]) -> dict[Path, FileState]:
    """The present state of each file: a later pass must find the same."""
    return {path: FileState.of(path) for path in files}
