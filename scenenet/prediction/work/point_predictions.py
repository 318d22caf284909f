"""What was predicted for the points of a survey."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.line.records import SurveyLine
from scenenet.pointcloud.targets import TOWER, WIRE, Target
from scenenet.prediction.work.conductor_points import ConductorOwners
from scenenet.prediction.work.lattice import Lattice, groups
from scenenet.prediction.work.structures import Owners, Structures
from scenenet.prediction.work.survey_system import in_metres
from scenenet.prediction.work.tile_predictions import TilePredictions


@dataclass(frozen=True)
class TargetTiles:
    """The predictions of a model for the tiles of a survey, and what they are for.

    Attributes:
        tiles: the predictions, for all tiles with a point that will be asked for.
        lattice: of its voxels.
        target: what the model finds.
        tau: of the model. Which points are taken for towers follows from their shapes instead.
        code: class code that points taken for the target get where classes are written; None to
            keep their codes.
    """

    tiles: TilePredictions
    lattice: Lattice
    target: Target = TOWER
    tau: float = 1.0
    code: int | None = None


@dataclass(frozen=True)
class TargetPredictions:
    """The predictions of one model for points.

    Attributes:
        probability: (n,) float32.
        shares: (n, K) float32, one column for each GENEO.
    """

    probability: np.ndarray
    shares: np.ndarray


@dataclass(frozen=True)
class PointPredictions:
    """The predictions for points.

    Attributes:
        models: of each model, in the order of ``PointLookUp.models``.
        tower_id: (n,) uint32, 0 for no tower.
        span_id, conductor_id: (n,) uint32 and uint16, the span and the conductor in it that the
            point lies on, 0 for none; None where no line was looked for.
    """

    models: tuple[TargetPredictions, ...]
    tower_id: np.ndarray
    span_id: np.ndarray | None = None
    conductor_id: np.ndarray | None = None

    @property
    def probability(self) -> np.ndarray:
        """(n,) float32, of the first model."""
        return self.models[0].probability

    @property
    def shares(self) -> np.ndarray:
        """(n, K) float32, of the first model."""
        return self.models[0].shares


class PointLookUp:
    """Says what was predicted for a point.

    Attributes:
        models: the predictions of each model for tiles.
        has_line: whether it says which conductor a point lies on.
    """

    def __init__(
        self,
        models: Sequence[TargetTiles],
        structures: Structures,
        unit_sizes: tuple[float, float, float],
        line: SurveyLine | None = None,
    ) -> None:
        """Sort the structures and the conductors by place.

        Args:
            models: at least one.
            structures: all that reach into a tile with a point that will be asked for, found by the
                first model.
            unit_sizes: sizes in m of the units of x, y and z.
            line: the lines of the survey; None if none were looked for.
        """
        self.models = tuple(models)
        self.has_line = line is not None
        self._unit_sizes = unit_sizes
        lattice = self.models[0].lattice
        self._owners = Owners(structures, lattice)
        self._conductors = None if line is None else ConductorOwners(line.conductors, lattice)

    def __call__(self, xyz: np.ndarray) -> PointPredictions:
        """The predictions for points (n, 3) of the survey, in its units."""
        xyz = in_metres(xyz, self._unit_sizes)
        located: dict[Lattice, tuple[np.ndarray, np.ndarray]] = {}
        for model in self.models:
            if model.lattice not in located:
                located[model.lattice] = model.lattice.locate(xyz)
        found = tuple(_look_up(model.tiles, *located[model.lattice]) for model in self.models)
        codes, _ = located[self.models[0].lattice]
        on = (None, None) if self._conductors is None else self._conductors(xyz, codes)
        return PointPredictions(found, self._owners(xyz, codes), *on)

    def taken(self, points: PointPredictions, number: int) -> np.ndarray:
        """(n,) bool, which points are taken for the target of the model with a number.

        For towers these are their points. For another target they are those in voxels at or above
        tau, and for wires also those on a conductor that are of no tower: the observer misses
        single voxels of a wire."""
        model = self.models[number]
        if model.target.is_tower:
            return points.tower_id > 0
        found = points.models[number].probability >= model.tau
        if model.target.name == WIRE and points.conductor_id is not None:
            found |= (points.conductor_id > 0) & (points.tower_id == 0)
        return found


def _look_up(tiles: TilePredictions, codes: np.ndarray, voxels: np.ndarray) -> TargetPredictions:
    """What ``tiles`` say about points in the voxels (n,) of the tiles with ``codes`` (n,)."""
    probability = np.zeros(len(codes), np.float32)
    shares = np.zeros((len(codes), len(tiles.geneos)), np.float32)
    for code, rows in groups(codes):
        prediction = tiles.kept(code)
        at = np.searchsorted(prediction.voxel, voxels[rows])
        probability[rows] = prediction.probability[at]
        shares[rows] = prediction.shares[at]
    return TargetPredictions(probability, shares)
