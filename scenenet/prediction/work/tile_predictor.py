"""The model on the tiles of a survey: the work of the stage that predicts a file."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.files import atomic
from scenenet.core.progress import track
from scenenet.dataset.voxel_measures import VoxelMeasures
from scenenet.measurement.heights import columns_around
from scenenet.measurement.registry import PRESENCE, measurement_named
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.work.block_file import BlockWriter
from scenenet.prediction.work.lattice import EDGE, by_column, code_of
from scenenet.prediction.work.tile_predictions import PREDICTED_KINDS, TilePrediction, geneo_names
from scenenet.prediction.work.tiling import Layer, Tile, TileSpool
from scenenet.prediction.work.work_file import WorkFile

if TYPE_CHECKING:
    from torch import Tensor

    from scenenet.models.base import VoxelModel
    from scenenet.models.model_file import ModelCard


AT_ONCE, MOST_AT_ONCE = 4096, 64
"""Tiles are predicted together until they have so many voxels, or there are so many of them: a
survey with points far apart has a thousand tiles of a voxel each."""


KEPT_ANSWERS = 16_000_000
"""Answers of a first observer in memory, 4 bytes each: those of three rows of tiles of a survey
some kilometres wide."""


def predict_file(
    own: WorkFile,
    spool: TileSpool,
    out: str | Path,
    model: VoxelModel,
    card: ModelCard,
    fullest: int,
    *,
    done: Container[int] = (),
) -> None:
    """Predict the tiles in which a file has points, and write the predictions to a file of blocks.

    A tile is predicted with all its voxels, also those of other files, so that it does not matter
    which file it is predicted for.

    Args:
        own: the work file of the file.
        spool: the voxels of the file and of all files near it.
        out: file to write.
        model, card: the model and what its file says about it.
        fullest: points in the fullest voxel of the survey (``fullest_voxel``).
        done: codes of tiles that need no prediction, because another file has it.

    Raises:
        OutputError: ``out`` cannot be written.
    """
    codes = sorted((c for c in own.blocks.codes(spool.kind) if c not in done), key=by_column)
    tiles = (spool.tile(code) for code in codes)
    predict = TilePredictor(model, card.measurement, spool.voxel_size, fullest)
    with atomic(out) as partial, partial.open("wb") as stream:
        blocks = BlockWriter(stream, PREDICTED_KINDS)
        label = f"{own.file.path.name}: blocks predicted ({card.finds.name})"
        for together in _together(track(tiles, label, total=len(codes))):
            predicted = predict(spool, together)
            for tile, (probability, shares) in zip(together, predicted, strict=True):
                prediction = TilePrediction(tile.voxel, probability, shares)
                blocks.add("predictions", code_of(tile.place), prediction.records())
        blocks.end({
            "geneos": geneo_names(model),
            "target": card.target,
            "tau": card.threshold(),
            "voxel_size": spool.voxel_size,
        })  # fmt: skip


def observed_voxel_size(model: VoxelModel, card: ModelCard, settings: PredictSettings) -> float:
    """m, edge of the voxels, or blocks of voxels, in which a model observes a survey."""
    return model.observed_size(settings.voxel_size or card.voxel_size)


def layer_of(card: ModelCard, voxel_size: float) -> Layer:
    """The voxels of ``voxel_size`` m in which a model observes a survey."""
    needs_points = bool(measurement_named(card.measurement).fields)
    return Layer(voxel_size, card.measurement if needs_points else "")


def needed_around(model: VoxelModel, card: ModelCard, voxel_size: float) -> float:
    """m around the points of a file within which all other files must be in the spool: a tile of
    voxels reaches beyond the file, its halo beyond the tile, and the ground below a voxel beyond
    the halo."""
    reach = max(model.at(voxel_size).reach[1:])
    if "height" in measurement_named(card.measurement).needs:
        reach += columns_around(voxel_size)
    return (EDGE + reach) * voxel_size


def fullest_voxel(spool: TileSpool, card: ModelCard) -> int:
    """Points in the fullest voxel of the survey, for a model whose measurement needs it; 1 for
    others.

    There is one number for the whole survey: one for each tile would show as seams.
    """
    if "fullest" not in measurement_named(card.measurement).needs:
        return 1
    return max((int(tile.count.max()) for tile in spool.tiles()), default=1)


class TilePredictor:
    """A model at the voxel size of a survey. Its kernels are sampled once, for all tiles.

    Attributes:
        model: at that voxel size.
        reach: of the model, voxels (z, y, x).
    """

    def __init__(
        self,
        model: VoxelModel,
        measurement: str,
        voxel_size: float,
        fullest: int,
        *,
        above_zero: bool = False,
    ) -> None:
        """Sample the kernels.

        Args:
            measurement: of the model (``ModelCard``).
            voxel_size: m.
            fullest: points in the fullest voxel of the survey (``fullest_voxel``).
            above_zero: whether only probabilities are wanted; shares may then be wrong where the
                probability is 0.

        Raises:
            InputError: the ground below a voxel would be looked for beyond the next tile.
        """
        import torch

        from scenenet.models.metric_scenenet import MetricSceneNet

        self.model = model.at(voxel_size)
        self.reach = self.model.reach
        beyond = 0
        if "height" in measurement_named(measurement).needs:
            beyond = columns_around(voxel_size)
        if max(self.reach[1:]) + beyond > EDGE:
            raise InputError(
                f"voxels of {voxel_size:g} m are too small for measurement {measurement!r}, which "
                f"looks for the ground {beyond} voxels beyond what the kernels reach, together at "
                f"most {EDGE}",
                remedy="Observe larger voxels, or use another measurement",
            )
        self._beyond = beyond
        self._measurement, self._fullest = measurement, fullest
        self._first: FirstAnswers | None = None
        with torch.no_grad():
            if isinstance(self.model, MetricSceneNet) and not self.model.linear:
                self._at_rows = self.model.row_responder(above_zero=above_zero)
                if self.model.first is not None:
                    self._first = FirstAnswers(
                        TilePredictor(
                            self.model.first, measurement, voxel_size, fullest, above_zero=True
                        )
                    )
            else:
                responses = self.model.responder()
                self._at_rows = lambda grids, rows: responses(grids)[:, torch.from_numpy(rows)]

    def __call__(
        self, spool: TileSpool, tiles: Sequence[Tile]
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Probability (M,) and shares (M, K) at the occupied voxels of each tile.

        The halo is as wide as the reach of the kernels, so that every voxel gets the value that it
        would have without tiles.
        """
        import torch

        from scenenet.models.geneo_model import GeneoModel

        with torch.no_grad():
            # The shares are those of the voxel that the maximum of the cross-section is from.
            parts = (
                self._parts(spool, tiles) if self._first is None else self._composed(spool, tiles)
            )
            observed = parts.sum(dim=0)
            if isinstance(self.model, GeneoModel):
                weight = parts.abs().sum(dim=0).clamp(min=torch.finfo(parts.dtype).tiny)
                shares = (parts / weight).T.contiguous().numpy()
            else:
                shares = np.empty((len(observed), 0), np.float32)
            probability = torch.relu(torch.tanh(observed)).numpy()
        ends = np.cumsum([len(tile.voxel) for tile in tiles])[:-1]
        return list(zip(np.split(probability, ends), np.split(shares, ends), strict=True))

    def _parts(self, spool: TileSpool, tiles: Sequence[Tile]) -> Tensor:
        """Parts (K, M) of H at the occupied voxels of the tiles."""

        from scenenet.convolution.occupancy import Occupancy

        reach = self.reach
        shape = _with_halo(reach)
        scenes = [spool.around(tile.place, reach) for tile in tiles]
        phi = None
        if self._measurement != PRESENCE:
            phi = [self._phi(spool, scene, reach) for scene in scenes]
        occupancy = Occupancy.of_grids([scene.voxel for scene in scenes], phi, shape)
        inner = [
            first + _inner(scene.voxel, shape, reach)
            for first, scene in zip(occupancy.offsets[:-1], scenes, strict=True)
        ]
        return self._at_rows(occupancy, np.concatenate(inner))

    def _composed(self, spool: TileSpool, tiles: Sequence[Tile]) -> Tensor:
        """The same for a model with a first observer, which is asked once for each tile, and not
        once more for each halo."""
        import torch

        from scenenet.convolution.occupancy import Occupancy

        assert self._first is not None
        answers = self._first.of(spool)
        z, y, x = (own - before for own, before in zip(self.reach, self._first.reach, strict=True))
        reach = z, y, x
        shape = _with_halo(reach)
        scenes = [spool.valued_around(tile.place, reach, answers) for tile in tiles]
        voxels, values = zip(*scenes, strict=True)
        measured = Occupancy.of_grids(voxels, values, shape)
        rows, places = [], []
        n = 0
        for start, voxel, tile in zip(measured.offsets[:-1], voxels, tiles, strict=True):
            rows.append(start + _inner(voxel, shape, reach))
            places.append(n + np.flatnonzero(answers(code_of(tile.place)) > 0))
            n += len(tile.voxel)
        found = self._at_rows(measured, np.concatenate(rows))
        parts = torch.zeros((len(found), n), dtype=found.dtype)
        parts[:, torch.from_numpy(np.concatenate(places))] = found
        return parts

    def _phi(self, spool: TileSpool, scene: Tile, reach: tuple[int, int, int]) -> np.ndarray:
        """The measurement at the voxels (M,) of a tile with its halo."""
        shape = [EDGE + 2 * r for r in reach]
        corner = np.array(scene.place) * EDGE - reach
        zyx, around = np.stack(np.unravel_index(scene.voxel, shape), axis=1) + corner, None
        if self._beyond:
            wide = reach[1] + self._beyond, reach[2] + self._beyond
            around = spool.columns_around(scene.place, wide)
        known = (scene.count, scene.total, spool.voxel_size, around, self._fullest)
        return VoxelMeasures(zyx, *known).phi(self._measurement)


class FirstAnswers:
    """What the first observer of a model answers, tile by tile. The last answers stay in memory,
    because the halos of the next tiles need them.

    Attributes:
        reach: of that observer, voxels (z, y, x).
    """

    def __init__(self, predict: TilePredictor) -> None:
        """Ask nothing yet."""
        self._predict = predict
        self.reach = predict.reach
        self._kept: OrderedDict[int, np.ndarray] = OrderedDict()
        self._voxels = 0

    def of(self, spool: TileSpool) -> Callable[[int], np.ndarray]:
        """Gives the answers (M,) float32 in [0, 1] at the voxels of the tile with a code."""

        def answers(code: int) -> np.ndarray:
            if code not in self._kept:
                [(probability, _)] = self._predict(spool, [spool.tile(code)])
                self._kept[code] = probability
                self._voxels += len(probability)
                while self._voxels > KEPT_ANSWERS and len(self._kept) > 1:
                    self._voxels -= len(self._kept.popitem(last=False)[1])
            self._kept.move_to_end(code)
            return self._kept[code]

        return answers


def _with_halo(reach: tuple[int, int, int]) -> tuple[int, int, int]:
    """(D, H, W) of a tile with ``reach`` voxels around it."""
    return EDGE + 2 * reach[0], EDGE + 2 * reach[1], EDGE + 2 * reach[2]


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
