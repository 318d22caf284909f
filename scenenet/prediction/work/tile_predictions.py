"""The predictions of a model for the tiles of a survey, on disk."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from scenenet.pointcloud.targets import Target
from scenenet.prediction.work.block_file import BlockFile
from scenenet.prediction.work.lattice import Lattice, on_lattice, place_of

if TYPE_CHECKING:
    from scenenet.models.base import VoxelModel

PREDICTED_KINDS = ("predictions",)
"""Blocks of each tile in a file of predictions."""


@dataclass(frozen=True)
class TilePrediction:
    """The predictions for the occupied voxels of a tile.

    Attributes:
        voxel: (M,) int32 positions within the tile, ascending.
        probability: (M,) float32.
        shares: (M, K) float32, contribution of each GENEO to the observer, divided by the sum of
            the absolute contributions. K is 0 for a model without GENEOs.
    """

    voxel: np.ndarray
    probability: np.ndarray
    shares: np.ndarray

    def records(self) -> np.ndarray:
        """(M,) records for a file of blocks."""
        records = np.empty(len(self.voxel), _record(self.shares.shape[1]))
        for name in records.dtype.names or ():
            records[name] = getattr(self, name)
        return records

    @classmethod
    def of(cls, records: np.ndarray) -> TilePrediction:
        """What ``records`` gave."""
        return cls(**{name: records[name].copy() for name in records.dtype.names or ()})


def _record(n_shares: int) -> np.dtype:
    """A voxel in a file of predictions."""
    return np.dtype([("voxel", "<i4"), ("probability", "<f4"), ("shares", "<f4", (n_shares,))])


class TilePredictions:
    """The predictions for the tiles of a survey, or of a part of it.

    Attributes:
        geneos: names of the GENEOs of the model; empty for a model without any.
    """

    def __init__(self, files: Sequence[BlockFile]) -> None:
        """Look at the files.

        Args:
            files: files of predictions by one model, at least one. Where two have the same tile,
                they have the same values.
        """
        self._facts = files[0].facts
        self.geneos = tuple(self._facts["geneos"])
        self._files = {code: file for file in files for code in file.codes("predictions")}
        self._cached = lru_cache(maxsize=64)(self.read)

    @property
    def target(self) -> Target:
        """What the model finds."""
        return Target.parse(self._facts["target"])

    @property
    def tau(self) -> float:
        """Threshold of the model."""
        return float(self._facts["tau"])

    @property
    def lattice(self) -> Lattice:
        """Of the voxels."""
        return Lattice(self._facts["voxel_size"])

    def read(self, code: int) -> TilePrediction:
        """The prediction of the tile with ``code``."""
        return TilePrediction.of(
            self._files[code].read("predictions", code, _record(len(self.geneos)))
        )

    def kept(self, code: int) -> TilePrediction:
        """As ``read``; the tiles that were used last stay in memory."""
        return self._cached(code)

    def detected(
        self, threshold: float, codes: Iterable[int]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The voxels with probability >= ``threshold`` in the tiles with ``codes``: lattice
        positions (V, 3) int32, probability (V,) and shares (V, K), in an order that does not depend
        on that of the codes."""
        zyx = [np.empty((0, 3), np.int32)]
        probability = [np.empty(0, np.float32)]
        shares = [np.empty((0, len(self.geneos)), np.float32)]
        for code in sorted(codes):
            prediction = self.read(code)
            found = prediction.probability >= threshold
            if found.any():
                positions = on_lattice(place_of(code), prediction.voxel[found])
                zyx.append(positions.astype(np.int32))
                probability.append(prediction.probability[found])
                shares.append(prediction.shares[found])
        return np.concatenate(zyx), np.concatenate(probability), np.concatenate(shares)


def geneo_names(model: VoxelModel) -> tuple[str, ...]:
    """Names of the GENEOs of a model; empty for a model without any."""
    from scenenet.models.geneo_model import GeneoModel

    return tuple(model.names) if isinstance(model, GeneoModel) else ()
