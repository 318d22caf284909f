"""The lines of a survey: found in the predictions of a model of wires, from tower to tower, and
the towers that they ask for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from scenenet.detection.survey_tower import SurveyTower
from scenenet.line.bypassed import bypassed_towers
from scenenet.line.find_line import find_line
from scenenet.line.notes import EXPECTED, FOUND_AGAIN, PASSED, UNHELD, LineNote
from scenenet.line.passed import passed_towers
from scenenet.line.records import SurveyLine
from scenenet.line.rejected import without_conductors
from scenenet.line.traced_spans import REACH_M, LineTower
from scenenet.line.wire_points import WirePoints
from scenenet.prediction.found_towers import FoundTowers, TowerSearch, find_near
from scenenet.prediction.surroundings import occupied_voxels
from scenenet.prediction.work.lattice import groups
from scenenet.prediction.work.survey_system import SurveySystem
from scenenet.prediction.work.tile_predictions import TilePredictions
from scenenet.prediction.work.tiling import TileSpool

SURE, DOUBTFUL = 0.85, 0.7
"""Shares of tau from which points may be those of a wire, and from which they count beside wires
that are found. The tracing has tests of its own, and the observer is less sure of a wire with few
points, such as an earth wire, and of wires close to trees."""

AGAIN_M = REACH_M
"""m around a place at which the line expects a tower, in which it is looked for again: its wires
end at its crossarms."""


@dataclass(frozen=True)
class WireSearch:
    """What the conductors of a survey are looked for in.

    Attributes:
        spool: the voxels of the survey that a model of wires observes.
        predictions: of that model, for all its tiles.
        tau: of that model.
    """

    spool: TileSpool
    predictions: TilePredictions
    tau: float


class Rejects(Protocol):
    """What people decided about conductors."""

    @property
    def files(self) -> Sequence[Path]:
        """The files that say it."""
        ...

    def __call__(self, line: SurveyLine, system: SurveySystem) -> Set[tuple[int, int]]:
        """The conductors of a survey that were rejected: (``span_id``, ``conductor_id``) of each.

        Args:
            line: m.
            system: of the coordinates of the survey.
        """
        ...


@dataclass(frozen=True)
class FoundLine:
    """The lines of a survey.

    Attributes:
        line: m.
        towers: of the survey, with those that the line asked for.
    """

    line: SurveyLine
    towers: FoundTowers

    def reviewed(self, rejects: Rejects | None, system: SurveySystem) -> FoundLine:
        """The same without the conductors that people rejected.

        Args:
            rejects: None if nobody did.
            system: of the coordinates of the survey.
        """
        if rejects is None:
            return self
        towers = [_in_metres(tower, system.unit_sizes) for tower in self.towers.towers]
        line = without_conductors(self.line, towers, rejects(self.line, system))
        return replace(self, line=line)

    def to_json(self) -> dict[str, Any]:
        return {"line": self.line.to_json(), "towers": self.towers.to_json()}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> FoundLine:
        """What ``to_json`` gave."""
        return cls(SurveyLine.from_json(data["line"]), FoundTowers.from_json(data["towers"]))


def find_line_in_survey(
    wires: WireSearch, towers: TowerSearch, found: FoundTowers, progress: str | None = None
) -> FoundLine:
    """Find the lines of a survey, and the towers that they ask for.

    Where wires end in the air amid the survey, a tower is expected and looked for once more. It is
    kept if the line then leads to it. Towers that conductors pass without a bend are dropped, and
    listed as places to look at.

    Args:
        wires, towers: what conductors and towers are looked for in.
        found: the towers of the survey.
        progress: label of the progress on stderr; None shows no progress.
    """
    points = _wire_points(wires, towers.spool)
    seen = occupied_voxels(towers.spool)
    dropped: set[int] = set()

    def between(own: FoundTowers) -> FoundLine:
        """The line between towers, less those that it passes: without them it runs on."""
        while True:
            known = [_in_metres(tower, towers.unit_sizes) for tower in own.towers]
            line = find_line(points, known, seen, progress)
            passed = passed_towers(known, line.conductors)
            passed |= bypassed_towers(known, line.spans, line.conductors)
            if not passed:
                return FoundLine(line, own)
            dropped.update(passed)
            own = own.without(passed)

    first = between(found)
    more = _with_expected(first.line, towers, first.towers)
    if more is first.towers:
        return _noted(first, _dropped_notes(found.towers, dropped, towers.unit_sizes))
    asked = between(more)
    places = {(tower.x, tower.y) for tower in first.towers.towers}

    def again() -> dict[int, SurveyTower]:
        return {t.id: t for t in asked.towers.towers if (t.x, t.y) not in places}

    idle = {note.tower for note in asked.line.notes if note.what == UNHELD} & again().keys()
    if idle:
        asked = between(asked.towers.without(idle))
    planar = towers.unit_sizes[0]
    notes = [
        LineNote(tower.x * planar, tower.y * planar, FOUND_AGAIN, number, 0)
        for number, tower in again().items()
    ]
    return _noted(asked, [*notes, *_dropped_notes(found.towers, dropped, towers.unit_sizes)])


def _noted(found: FoundLine, notes: Sequence[LineNote]) -> FoundLine:
    """The same with more places to look at."""
    return replace(found, line=replace(found.line, notes=(*found.line.notes, *notes)))


def _dropped_notes(
    towers: Sequence[SurveyTower], dropped: Set[int], unit_sizes: tuple[float, float, float]
) -> list[LineNote]:
    """The places of the towers of a list that were dropped; they have no id any more."""
    planar = unit_sizes[0]
    gone = (tower for tower in towers if tower.id in dropped)
    return [LineNote(tower.x * planar, tower.y * planar, PASSED, 0, 0) for tower in gone]


def _with_expected(line: SurveyLine, towers: TowerSearch, found: FoundTowers) -> FoundTowers:
    """The towers with those that are found where the line expects one; ``found`` itself if none
    is."""
    more = found
    for note in line.notes:
        if note.what == EXPECTED:
            near = find_near(towers, np.array([note.x, note.y]), AGAIN_M)
            more = more.with_others(near, towers.settings.eps, towers.unit_sizes)
    return more if len(more.towers) > len(found.towers) else found


def _wire_points(wires: WireSearch, spool: TileSpool) -> WirePoints:
    """The points of a spool in voxels that may be on wires. They alone are in memory."""
    found = {}
    for code, _ in wires.spool.places():
        prediction = wires.predictions.read(code)
        near = prediction.probability >= DOUBTFUL * wires.tau
        if near.any():
            found[code] = prediction.voxel[near], prediction.probability[near] >= SURE * wires.tau
    places, sure = [np.empty((0, 3))], [np.empty(0, bool)]
    for tile, _ in spool.places() if found else ():
        xyz = spool.points(tile)
        codes, voxels = wires.spool.lattice.locate(xyz)
        for code, rows in groups(codes):
            if code in found:
                own, certain = found[code]
                at = np.minimum(np.searchsorted(own, voxels[rows]), len(own) - 1)
                on = own[at] == voxels[rows]
                places.append(xyz[rows[on]])
                sure.append(certain[at[on]])
    return WirePoints(np.concatenate(places), np.concatenate(sure))


def _in_metres(tower: SurveyTower, unit_sizes: tuple[float, float, float]) -> LineTower:
    planar, _, vertical = unit_sizes
    return LineTower(
        tower.id, tower.x * planar, tower.y * planar, tower.base * vertical,
        tower.height * vertical, tower.width * planar, tower.conductor_bearings,
    )  # fmt: skip
