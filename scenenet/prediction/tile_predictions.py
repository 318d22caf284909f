"""The predictions of a model for a survey, tile by tile on disk, and the towers found in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.progress import track
from scenenet.detection.edge_distance import MAX_M, edge_distance
from scenenet.detection.find import MeasuredTower, find_towers
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.structure import Structure
from scenenet.detection.survey_tower import SurveyTower
from scenenet.detection.tower_ids import tower_ids
from scenenet.prediction.surroundings import occupied_voxels, survey_points
from scenenet.prediction.tiling import EDGE, Tile, TileSpool, code_of, groups

if TYPE_CHECKING:
    from scenenet.dataset.voxels import Measurement
    from scenenet.models.base import VoxelModel
    from scenenet.models.model_file import ModelCard


AT_ONCE, MOST_AT_ONCE = 4096, 64
"""Tiles are predicted together until they have so many voxels, or there are so many of them: a
survey with points far apart has a thousand tiles of a voxel each."""


@dataclass(frozen=True)
class TilePrediction:
    """The predictions for the occupied voxels of a tile.

    Attributes:
        voxel: (M,) int32 positions within the tile, ascending.
        probability: (M,) float32.
        shares: (M, K) float32, contribution of each GENEO to the observer, divided by the sum of
            the absolute contributions. K is 0 for a model without GENEOs.
        tower: (M,) uint32 id of the tower that the voxel belongs to, 0 for none.
    """

    voxel: np.ndarray
    probability: np.ndarray
    shares: np.ndarray
    tower: np.ndarray

    def save(self, path: Path) -> None:
        records = np.empty(len(self.voxel), _record(self.shares.shape[1]))
        for name in records.dtype.names or ():
            records[name] = getattr(self, name)
        path.write_bytes(records.tobytes())  # numpy's own writing hides why the disk refuses

    @classmethod
    def read(cls, path: Path, n_shares: int) -> TilePrediction:
        """What ``save`` wrote, with ``n_shares`` GENEOs.

        A survey with points far apart has a thousand tiles of a point each, which an archive of
        arrays would make slow.
        """
        records = np.fromfile(path, _record(n_shares))
        return cls(**{name: records[name].copy() for name in records.dtype.names or ()})


def _record(n_shares: int) -> np.dtype:
    """A voxel in the file of a tile."""
    return np.dtype([
        ("voxel", "<i4"), ("probability", "<f4"), ("shares", "<f4", (n_shares,)), ("tower", "<u4"),
    ])  # fmt: skip


@dataclass(frozen=True)
class PointPredictions:
    """The predictions for points of a survey.

    Attributes:
        probability: (n,) float32, of the voxel that holds the point.
        tower_id: (n,) uint32, 0 for none.
        shares: (n, K) float32; see ``TilePrediction``.
    """

    probability: np.ndarray
    tower_id: np.ndarray
    shares: np.ndarray


class TilePredictions:
    """The predictions of a model for every tile of a survey, one file a tile."""

    def __init__(self, spool: TileSpool, folder: Path, geneos: Sequence[str]) -> None:
        """Nothing is predicted yet.

        Args:
            spool: the occupied voxels of the survey.
            folder: existing folder for the predictions.
            geneos: names of the GENEOs of the model; empty for a model without any.
        """
        self.spool = spool
        self.geneos = tuple(geneos)
        self._folder = folder
        self._structures: list[tuple[int, Structure]] = []
        self._cached = lru_cache(maxsize=64)(self._read)

    def compute(self, model: VoxelModel, card: ModelCard, label: str) -> None:
        """Run the model over all tiles."""
        fullest = 1
        if card.measurement == "density":
            # One maximum for the whole survey: one for each tile would show as seams.
            fullest = max((int(tile.count.max()) for tile in self.spool.tiles()), default=1)
        predict = TilePredictor(model, card.measurement, self.spool.voxel_size, fullest)
        for tiles in _together(track(self.spool.tiles(), label, total=len(self.spool))):
            predicted = predict(self.spool, tiles)
            for tile, (probability, shares) in zip(tiles, predicted, strict=True):
                tower = np.zeros(len(tile.voxel), np.uint32)
                prediction = TilePrediction(tile.voxel, probability, shares, tower)
                prediction.save(self._path(code_of(tile.place)))

    def find_towers(self, tau: float, settings: DetectionSettings) -> list[SurveyTower]:
        """Find the towers of the survey and write the id of each into the voxels of its points."""
        zyx, probability, shares = self._detected(settings.threshold(tau))
        occupied, points = occupied_voxels(self.spool), survey_points(self.spool)
        found = find_towers(
            self.spool.centres(zyx),
            probability,
            occupied,
            points,
            self.spool.voxel_size,
            tau,
            settings,
        )
        towers = []
        numbers = tower_ids(np.array([(tower.x, tower.y) for tower in found]).reshape(-1, 2))
        for number, tower in zip(numbers, found, strict=True):
            place = np.array([tower.x, tower.y])
            near = points(place, tower.structure.reach)
            own = near[tower.structure.contains(near)]
            own = own[self.owner(own) == 0]  # points in two shapes belong to the earlier tower
            self._number(own, number)
            self._structures.append((number, tower.structure))
            distance = edge_distance(place, occupied(place, MAX_M * 1.5)[:, :2])
            mean_shares = shares[tower.voxels].mean(axis=0)
            towers.append(self._entry(tower, number, len(own), distance, mean_shares))
        return towers

    def look_up(self, xyz: np.ndarray) -> PointPredictions:
        """The predictions for points (n, 3) m of the survey."""
        probability = np.zeros(len(xyz), np.float32)
        tower = np.zeros(len(xyz), np.uint32)
        shares = np.zeros((len(xyz), len(self.geneos)), np.float32)
        codes, voxels = self.spool.locate(xyz)
        for code, rows in groups(codes):
            prediction = self._cached(code)
            at = np.searchsorted(prediction.voxel, voxels[rows])
            probability[rows] = prediction.probability[at]
            tower[rows] = prediction.tower[at]
            shares[rows] = prediction.shares[at]
        # A voxel with a tower's points may have others, and those of a second tower.
        rows = np.flatnonzero(tower)
        tower[rows] = self.owner(xyz[rows])
        return PointPredictions(probability, tower, shares)

    def _detected(self, threshold: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The voxels with probability >= ``threshold``: lattice positions (V, 3), probability (V,)
        and shares (V, K)."""
        zyx = [np.empty((0, 3), np.int64)]
        probability = [np.empty(0, np.float32)]
        shares = [np.empty((0, len(self.geneos)), np.float32)]
        for tile in self.spool.tiles():
            prediction = self._read(code_of(tile.place))
            detected = prediction.probability >= threshold
            zyx.append(tile.zyx()[detected])
            probability.append(prediction.probability[detected])
            shares.append(prediction.shares[detected])
        return np.concatenate(zyx), np.concatenate(probability), np.concatenate(shares)

    def _entry(
        self, tower: MeasuredTower, number: int, points: int, distance: float, shares: np.ndarray
    ) -> SurveyTower:
        return SurveyTower(
            id=number,
            x=tower.x,
            y=tower.y,
            height=tower.height,
            base=tower.base,
            width=tower.width,
            conductor_directions=len(tower.spans),
            conductor_bearings=tuple(span.bearing for span in tower.spans),
            probability=tower.probability,
            points=points,
            edge_distance=distance,
            contributions={
                geneo: float(share) for geneo, share in zip(self.geneos, shares, strict=True)
            },
        )

    def owner(self, xyz: np.ndarray) -> np.ndarray:
        """(n,) uint32, id of the first tower whose shape has each of the points (n, 3) m, or 0."""
        owner = np.zeros(len(xyz), np.uint32)
        if not len(xyz):
            return owner
        (west, south), (east, north) = xyz[:, :2].min(axis=0), xyz[:, :2].max(axis=0)
        for number, structure in self._structures:
            x, y, reach = structure.x, structure.y, structure.reach
            if not (west - reach <= x <= east + reach and south - reach <= y <= north + reach):
                continue
            away = np.hypot(xyz[:, 0] - structure.x, xyz[:, 1] - structure.y)
            rows = np.flatnonzero((owner == 0) & (away <= structure.reach))
            owner[rows[structure.contains(xyz[rows])]] = number
        return owner

    def _number(self, points: np.ndarray, number: int) -> None:
        """Write the id of a tower into the voxels of its points (n, 3) m.

        Voxels of an earlier tower keep its id.
        """
        codes, voxels = self.spool.locate(points)
        for code, rows in groups(codes):
            prediction = self._read(code)
            at = np.unique(np.searchsorted(prediction.voxel, voxels[rows]))
            prediction.tower[at[prediction.tower[at] == 0]] = number
            prediction.save(self._path(code))

    def _read(self, code: int) -> TilePrediction:
        return TilePrediction.read(self._path(code), len(self.geneos))

    def _path(self, code: int) -> Path:
        return self._folder / f"{code}.prediction"


class TilePredictor:
    """A model at the voxel size of a survey. Its kernels are sampled once, for all tiles."""

    def __init__(
        self, model: VoxelModel, measurement: Measurement, voxel_size: float, fullest: int
    ) -> None:
        """Sample the kernels.

        Args:
            measurement: of the model (``ModelCard``).
            voxel_size: m.
            fullest: points in the fullest voxel of the survey, for measurement ``density``.
        """
        import torch

        from scenenet.models.geneo_model import GeneoModel

        self.model = model.at(voxel_size)
        self._fullest = fullest if measurement == "density" else None
        self._bias: torch.Tensor | None = None
        with torch.no_grad():
            if isinstance(self.model, GeneoModel):
                self._kernels = self.model.weighted_kernels()
            else:
                kernel, self._bias = self.model.observer()
                self._kernels = kernel[None]

    def __call__(
        self, spool: TileSpool, tiles: Sequence[Tile]
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Probability (M,) and shares (M, K) at the occupied voxels of each tile.

        The halo is as wide as the reach of the kernels, so that every voxel gets the value that it
        would have without tiles.
        """
        import torch

        from scenenet.convolution.occupancy import Occupancy
        from scenenet.models.geneo_model import GeneoModel

        reach = self.model.reach
        shape = EDGE + 2 * reach[0], EDGE + 2 * reach[1], EDGE + 2 * reach[2]
        scenes = [spool.around(tile.place, reach) for tile in tiles]
        phi = None
        if self._fullest is not None:
            phi = [(scene.count / self._fullest).astype(np.float32) for scene in scenes]
        occupancy = Occupancy.of_grids([scene.voxel for scene in scenes], phi, shape)
        inner = np.concatenate([
            first + _inner(scene.voxel, shape, reach)
            for first, scene in zip(occupancy.offsets[:-1], scenes, strict=True)
        ])  # fmt: skip
        with torch.no_grad():
            # The shares are those of the voxel that the maximum of the cross-section is from.
            parts = self.model.responses(occupancy, self._kernels)[:, torch.from_numpy(inner)]
            if isinstance(self.model, GeneoModel):
                observed = parts.sum(dim=0)
                weight = parts.abs().sum(dim=0).clamp(min=torch.finfo(parts.dtype).tiny)
                shares = (parts / weight).T.contiguous().numpy()
            else:
                observed = parts[0]
                observed = observed if self._bias is None else observed + self._bias
                shares = np.empty((len(inner), 0), np.float32)
            probability = torch.relu(torch.tanh(observed)).numpy()
        ends = np.cumsum([len(tile.voxel) for tile in tiles])[:-1]
        return list(zip(np.split(probability, ends), np.split(shares, ends), strict=True))


def _together(tiles: Iterable[Tile]) -> Iterator[list[Tile]]:
    """Groups of tiles that are predicted together."""
    group: list[Tile] = []
    for tile in tiles:
        group.append(tile)
        if len(group) == MOST_AT_ONCE or sum(len(one.voxel) for one in group) >= AT_ONCE:
            yield group
            group = []
    if group:
        yield group


def _inner(
    voxel: np.ndarray, shape: tuple[int, int, int], reach: tuple[int, int, int]
) -> np.ndarray:
    """Rows of ``voxel`` (M,), positions in a tile with its halo, that lie in the tile itself.

    They come in the order of the tile's own voxels, as both are ascending.
    """
    zyx = np.unravel_index(voxel, shape)
    inside = [(axis >= r) & (axis < r + EDGE) for axis, r in zip(zyx, reach, strict=True)]
    return np.flatnonzero(inside[0] & inside[1] & inside[2])
