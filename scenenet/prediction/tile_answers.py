"""What a model says of a survey, tile by tile, kept on disk; and the towers in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.progress import track
from scenenet.detection.detect import DetectedTower, detect_towers, whole_tower
from scenenet.detection.edge_distance import LOOK_M, edge_distance
from scenenet.detection.settings import DetectionSettings
from scenenet.prediction.occupied_voxels import OccupiedPlaces
from scenenet.prediction.tiling import EDGE, Tile, TileSpool, code_of, groups

if TYPE_CHECKING:
    from scenenet.models.base import VoxelModel
    from scenenet.models.model_file import ModelCard


@dataclass(frozen=True)
class TileAnswer:
    """What a model says of the occupied voxels of a tile.

    Attributes:
        voxel: (M,) int32 positions within the tile, ascending.
        probability: (M,) float32.
        shares: (M, K) float32, part of each GENEO in the observer's answer: what it adds or takes,
            divided by what all of them add and take. The absolute values sum to one. K is 0 for a
            model without GENEOs.
        tower: (M,) uint32 number of the tower it belongs to, 0 for none.
    """

    voxel: np.ndarray
    probability: np.ndarray
    shares: np.ndarray
    tower: np.ndarray

    def save(self, path: Path) -> None:
        np.savez(path, **self.__dict__)

    @classmethod
    def read(cls, path: Path) -> TileAnswer:
        with np.load(path, allow_pickle=False) as arrays:
            return cls(**{name: arrays[name] for name in arrays.files})


@dataclass(frozen=True)
class SurveyTower:
    """A tower of the list.

    Attributes:
        tower: where it is.
        id: number in the list, from 1.
        points: survey points in its voxels, those of its body and the detected ones.
        edge_distance: m to the edge of the data.
        shares: (K,) mean part of each GENEO over its detected voxels.
    """

    tower: DetectedTower
    id: int
    points: int
    edge_distance: float
    shares: np.ndarray


class TileAnswers:
    """The answers of a model for every tile of a survey, kept on disk."""

    def __init__(self, spool: TileSpool, folder: Path, n_shares: int) -> None:
        self.spool = spool
        self._folder = folder
        self._n_shares = n_shares
        self._cached = lru_cache(maxsize=64)(self._read)

    def compute(self, model: VoxelModel, card: ModelCard, label: str) -> None:
        """Run the model over all tiles."""
        fullest = 1
        if card.measurement == "density":
            # One measure for the whole survey; one for each tile would show as seams.
            fullest = max((int(tile.count.max()) for tile in self.spool.tiles()), default=1)
        for tile in track(self.spool.tiles(), label, total=len(self.spool)):
            probability, shares = answer_tile(self.spool, tile, model, card, fullest)
            tower = np.zeros(len(tile.voxel), np.uint32)
            TileAnswer(tile.voxel, probability, shares, tower).save(self._path(code_of(tile.place)))

    def find_towers(self, tau: float, settings: DetectionSettings) -> list[SurveyTower]:
        """Towers of the survey; the voxels of each, body and all, get its number."""
        zyx, probability, shares = [], [], []
        for tile in self.spool.tiles():
            answer = self._read(code_of(tile.place))
            hits = answer.probability >= settings.threshold(tau)
            zyx.append(tile.zyx()[hits])
            probability.append(answer.probability[hits])
            shares.append(answer.shares[hits])
        if not zyx:
            return []
        detected, certainty = np.concatenate(zyx), np.concatenate(probability)
        occupied = OccupiedPlaces(self.spool)
        found = detect_towers(
            self.spool.centres(detected),
            certainty,
            occupied,
            self.spool.voxel_size,
            tau,
            settings,
        )
        all_shares = np.concatenate(shares)
        towers = []
        for number, tower in enumerate(found, start=1):
            place = np.array([tower.x, tower.y])
            around = occupied(place, LOOK_M * 1.5)
            body = around[whole_tower(tower, around, settings)]
            sure = detected[tower.voxels[certainty[tower.voxels] >= tau]]
            points = self._number(np.concatenate([body, self.spool.centres(sure)]), number)
            towers.append(
                SurveyTower(
                    tower,
                    number,
                    points,
                    edge_distance(place, around[:, :2]),
                    all_shares[tower.voxels].mean(axis=0),
                )
            )
        return towers

    def of_points(self, xyz: np.ndarray, geneos: list[str]) -> Mapping[str, np.ndarray]:
        """The extra dimensions of points (n, 3) m, each (n,)."""
        probability = np.zeros(len(xyz), np.float32)
        tower = np.zeros(len(xyz), np.uint32)
        shares = np.zeros((len(xyz), len(geneos)), np.float32)
        codes, voxels = self.spool.locate(xyz)
        for code, rows in groups(codes):
            answer = self._cached(code)
            at = np.searchsorted(answer.voxel, voxels[rows])
            probability[rows] = answer.probability[at]
            tower[rows] = answer.tower[at]
            shares[rows] = answer.shares[at]
        named = {f"share_{geneo}": shares[:, k] for k, geneo in enumerate(geneos)}
        return {"tower_probability": probability, "tower_id": tower} | named

    def _number(self, centres: np.ndarray, number: int) -> int:
        """Write the number of a tower into its voxels, (M, 3) m, and count the points in them.

        What a tower before it has stays with that.
        """
        points = 0
        codes, voxels = self.spool.locate(centres)
        for code, rows in groups(codes):
            answer = self._read(code)
            at = np.unique(np.searchsorted(answer.voxel, voxels[rows]))
            mine = at[answer.tower[at] == 0]
            answer.tower[mine] = number
            answer.save(self._path(code))
            points += int(self.spool.tile(code).count[mine].sum())
        return points

    def _read(self, code: int) -> TileAnswer:
        return TileAnswer.read(self._path(code))

    def _path(self, code: int) -> Path:
        return self._folder / f"{code}.npz"


def answer_tile(
    spool: TileSpool, tile: Tile, model: VoxelModel, card: ModelCard, fullest: int
) -> tuple[np.ndarray, np.ndarray]:
    """Probability (M,) and shares (M, K) at the occupied voxels of a tile.

    The halo is as wide as the kernel reaches, so a voxel is answered as if there were no tiles.
    """
    import torch

    from scenenet.convolution.convolve import convolve_at_voxels
    from scenenet.convolution.occupancy import Occupancy
    from scenenet.models.geneo_model import GeneoModel

    model = model.at(spool.voxel_size)
    reach = model.reach
    shape = EDGE + 2 * reach[0], EDGE + 2 * reach[1], EDGE + 2 * reach[2]
    scene = spool.around(tile.place, reach)
    density = card.measurement == "density"
    phi = [(scene.count / fullest).astype(np.float32)] if density else None
    occupancy = Occupancy.of_grids([scene.voxel], phi, shape)
    inner = _inner(scene.voxel, shape, reach)
    with torch.no_grad():
        if isinstance(model, GeneoModel):
            parts = convolve_at_voxels(occupancy, model.weighted_kernels())
            # Reasons are those of the voxel whose answer it is.
            rows = model.argmax_rows(occupancy, parts.sum(dim=0))[inner]
            parts = parts[:, torch.from_numpy(rows)]
            observed = parts.sum(dim=0)
            weight = parts.abs().sum(dim=0).clamp(min=torch.finfo(parts.dtype).tiny)
            shares = (parts / weight).T.contiguous().numpy()
        else:
            kernel, bias = model.observer()
            observed = convolve_at_voxels(occupancy, kernel[None])[0, inner]
            observed = observed if bias is None else observed + bias
            shares = np.empty((len(tile.voxel), 0), np.float32)
        probability = torch.relu(torch.tanh(observed)).numpy()
    return probability, shares


def _inner(
    voxel: np.ndarray, shape: tuple[int, int, int], reach: tuple[int, int, int]
) -> np.ndarray:
    """Rows of ``voxel`` (M,), positions in a tile with its halo, that lie in the tile itself.

    They come in the order of the tile's own voxels, as both are ascending.
    """
    zyx = np.unravel_index(voxel, shape)
    inside = [(axis >= r) & (axis < r + EDGE) for axis, r in zip(zyx, reach, strict=True)]
    return np.flatnonzero(inside[0] & inside[1] & inside[2])
