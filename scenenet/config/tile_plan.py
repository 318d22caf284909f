"""The tiles of a survey in the workflow: their names, where they lie, and which are neighbours."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.config.survey import REPEATED, REPEATS, Survey
from scenenet.core.errors import InputError
from scenenet.core.files import read_json, write_json
from scenenet.core.provenance import fingerprint
from scenenet.core.settings import path_fault
from scenenet.pointcloud.las.crs import named_system
from scenenet.pointcloud.reading import survey_of_lengths
from scenenet.prediction.survey_files import SurveyFiles, result_name

NEIGHBOURS_M = 400.0
"""m between the bounding boxes of tiles that count as neighbours. A tile of 64 voxels of up to 3 m
and the halo of the kernels lie within it."""

UNREADABLE = "unreadable"
"""In place of the fingerprint of a tile that cannot be read; its own job says why."""

Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Tile:
    """A tile of a survey.

    Attributes:
        name: in the survey (``SurveyFiles.names``).
        path: its file.
        known: its fingerprint.
        box: (x, y, x, y), lowest and highest, in its units, by its header; None if that cannot be
            used, or without points.
        neighbours: results of its neighbours (keys of ``TilePlan.tiles``), sorted.
    """

    name: str
    path: str
    known: str
    box: Box | None
    neighbours: tuple[str, ...]


@dataclass(frozen=True)
class TilePlan:
    """The tiles of a survey.

    Attributes:
        survey: its files; those that the workflow cannot use are refused.
        tiles: name of the results of each tile, without its suffix -> the tile, in the order of the
            survey.
    """

    survey: SurveyFiles
    tiles: Mapping[str, Tile]


class HeaderCache:
    """Fingerprints and bounding boxes of tiles, kept in a file. A tile that was not written since
    is not opened again: a survey has thousands, and every job plans anew."""

    def __init__(self, path: str | Path) -> None:
        """Read the file, if it is there and whole."""
        self._path = Path(path)
        self._facts: dict[str, Any] = {}
        self._changed = False
        with contextlib.suppress(OSError, ValueError, TypeError):
            self._facts = dict(read_json(self._path))

    def facts(self, path: Path, content_below: int, crs: str | None) -> tuple[str, Box | None, Any]:
        """Fingerprint, box in the units of the tile and box in m."""
        try:
            status = path.stat()
        except OSError:
            return UNREADABLE, None, None
        state = [status.st_ino, status.st_size, status.st_mtime_ns, content_below, crs]
        key = str(path.absolute())
        kept = self._facts.get(key)
        if not isinstance(kept, dict) or kept.get("state") != state:
            kept = {"state": state, **_look_at(path, content_below, crs)}
            self._facts[key], self._changed = kept, True
        box = None if kept["box"] is None else tuple(kept["box"])
        return kept["known"], box, kept["box_m"]

    def save(self) -> None:
        """Write what was looked at. A folder that cannot be written to costs time, no more."""
        if self._changed:
            try:
                write_json(self._path, self._facts)
            except InputError:
                return
            self._changed = False


def _look_at(path: Path, content_below: int, crs: str | None) -> dict[str, Any]:
    try:
        known = fingerprint(path, content_below)
        info = survey_of_lengths(path, None if crs is None else named_system(crs))
    except InputError:
        # Its own job says what is wrong with it, and what is wrong may be what is known.
        try:
            return {"known": fingerprint(path, content_below), "box": None, "box_m": None}
        except InputError:
            return {"known": UNREADABLE, "box": None, "box_m": None}
    if not info.n_points or not np.isfinite([*info.mins, *info.maxs]).all():
        return {"known": known, "box": None, "box_m": None}
    box = [*info.mins[:2], *info.maxs[:2]]
    sizes = [*info.unit_sizes[:2]] * 2
    return {"known": known, "box": box, "box_m": [at * m for at, m in zip(box, sizes, strict=True)]}


def plan_tiles(survey: Survey, content_below: int, cache: HeaderCache) -> TilePlan:
    """The tiles of a survey of the sheet or the inbox.

    Args:
        content_below: bytes; smaller tiles are known by their content, others by size and time.
        cache: is added to, and not saved.

    Raises:
        InputError: the folder or the pattern has no LAS or LAZ file, or the index cannot be read.
    """
    crs = None if survey.crs is None else named_system(survey.crs)
    named = replace(SurveyFiles.of(survey.path, crs), name=survey.name)
    named = replace(named, refused={**named.refused, **dict(_unusable(named))})
    names = {path: name for path, name in named.names.items() if path not in named.refused}
    facts = {p: cache.facts(p, content_below, survey.crs) for p in names}
    near = _neighbours({result_name(names[p]): box for p, (_, _, box) in facts.items()})
    tiles = {
        result_name(name): Tile(name, str(path), *facts[path][:2], near[result_name(name)])
        for path, name in names.items()
    }
    return TilePlan(named, tiles)


def _unusable(survey: SurveyFiles) -> Iterator[tuple[Path, InputError]]:
    """Files that no job of the workflow can have as its input, with the reason."""
    names = {p: result_name(name) for p, name in survey.names.items() if p not in survey.refused}
    counts = Counter(names.values())
    for path, name in names.items():
        remedy = "Rename the file"
        if not path.exists():
            problem, remedy = "the file is not there", "Bring it back, or correct the tile index"
        elif fault := path_fault(f"{path}/{name}"):
            problem = f"the path {fault}"
        elif REPEATED.search(name):
            problem = f"its name {REPEATS}"
        elif counts[name] > 1:
            problem = "the results of two tiles would have the same name"
        else:
            continue
        yield path, InputError(problem, file=path, remedy=remedy)


def _neighbours(boxes: Mapping[str, list[float] | None]) -> dict[str, tuple[str, ...]]:
    """The others within ``NEIGHBOURS_M`` of each box (x, y, x, y), m; none of those without one."""
    placed = sorted(name for name, box in boxes.items() if box is not None)
    corners = np.array([boxes[name] for name in placed]).reshape(-1, 4)
    found: dict[str, tuple[str, ...]] = dict.fromkeys(boxes, ())
    for name, own in zip(placed, corners, strict=True):
        low = corners[:, :2] <= own[2:] + NEIGHBOURS_M
        high = corners[:, 2:] >= own[:2] - NEIGHBOURS_M
        near = np.flatnonzero(low.all(axis=1) & high.all(axis=1))
        found[name] = tuple(placed[row] for row in near if placed[row] != name)
    return found
