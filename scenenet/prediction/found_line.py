"""The lines of a survey: found in the predictions of a model of wires, from tower to tower."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from scenenet.detection.survey_tower import SurveyTower
from scenenet.line.find_line import find_line
from scenenet.line.hung import LineTower
from scenenet.line.records import SurveyLine
from scenenet.line.wire_points import WirePoints
from scenenet.prediction.surroundings import occupied_voxels
from scenenet.prediction.work.tile_predictions import TilePredictions
from scenenet.prediction.work.tiling import TileSpool, groups

DOUBTFUL = 0.7
"""Share of tau from which points count beside wires that are certain. The observer is less sure of
a single thin wire, such as an earth wire, and of wires close to trees."""


def find_line_in_survey(
    spool: TileSpool,
    wires: TileSpool,
    predictions: TilePredictions,
    tau: float,
    towers: Iterable[SurveyTower],
    unit_sizes: tuple[float, float, float],
    progress: str | None = None,
) -> SurveyLine:
    """Find the lines of a survey.

    Args:
        spool: the points of all its files.
        wires: its voxels, those that the model of wires observes.
        predictions: of that model, for all its tiles.
        tau: of that model.
        towers: found in the survey, in its units.
        unit_sizes: sizes in m of the units of its x, y and z.
        progress: label of the progress on stderr; None shows no progress.
    """
    points = _wire_points(spool, wires, predictions, tau)
    known = [_in_metres(tower, unit_sizes) for tower in towers]
    return find_line(points, known, occupied_voxels(spool), progress)


def _wire_points(
    spool: TileSpool, wires: TileSpool, predictions: TilePredictions, tau: float
) -> WirePoints:
    """The points in voxels that may be on wires. They alone are in memory."""
    found = {}
    for code, _ in wires.places():
        prediction = predictions.read(code)
        near = prediction.probability >= DOUBTFUL * tau
        if near.any():
            found[code] = prediction.voxel[near], prediction.probability[near] >= tau
    places, sure = [np.empty((0, 3))], [np.empty(0, bool)]
    for tile, _ in spool.places() if found else ():
        xyz = spool.points(tile)
        codes, voxels = wires.lattice.locate(xyz)
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
        tower.id, tower.x * planar, tower.y * planar, tower.base * vertical, tower.height * vertical
    )
