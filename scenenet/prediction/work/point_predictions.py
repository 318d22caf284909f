"""What was predicted for the points of a survey."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.prediction.work.structures import Owners, Structures
from scenenet.prediction.work.survey_system import in_metres
from scenenet.prediction.work.tile_predictions import TilePredictions
from scenenet.prediction.work.tiling import Lattice, groups


@dataclass(frozen=True)
class PointPredictions:
    """The predictions for points.

    Attributes:
        probability: (n,) float32.
        tower_id: (n,) uint32, 0 for no tower.
        shares: (n, K) float32, one column for each GENEO.
    """

    probability: np.ndarray
    tower_id: np.ndarray
    shares: np.ndarray


class PointLookUp:
    """Says what was predicted for a point."""

    def __init__(
        self,
        tiles: TilePredictions,
        structures: Structures,
        lattice: Lattice,
        unit_sizes: tuple[float, float, float],
    ) -> None:
        """Sort the structures by place.

        Args:
            tiles: the predictions, for all tiles with a point that will be asked for.
            structures: all that reach into such a tile.
            lattice: of the voxels.
            unit_sizes: sizes in m of the units of x, y and z.
        """
        self.geneos = tiles.geneos
        self._tiles, self._lattice, self._unit_sizes = tiles, lattice, unit_sizes
        self._owners = Owners(structures, lattice)

    def __call__(self, xyz: np.ndarray) -> PointPredictions:
        """The predictions for points (n, 3) of the survey, in its units."""
        xyz = in_metres(xyz, self._unit_sizes)
        probability = np.zeros(len(xyz), np.float32)
        shares = np.zeros((len(xyz), len(self.geneos)), np.float32)
        codes, voxels = self._lattice.locate(xyz)
        for code, rows in groups(codes):
            prediction = self._tiles.kept(code)
            at = np.searchsorted(prediction.voxel, voxels[rows])
            probability[rows] = prediction.probability[at]
            shares[rows] = prediction.shares[at]
        return PointPredictions(probability, self._owners(xyz, codes), shares)
