"""The occupied voxels of a batch of grids, the input of the convolution (thesis 4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.compiled.runs import Runs, runs_of
from scenenet.core.compilation import COMPILED

Shape = tuple[int, int, int]
"""(D, H, W): voxels along z, y, x."""


@dataclass(frozen=True)
class Occupancy:
    """A batch of sparse voxel grids of one shape.

    Attributes:
        index: (M,) int64, flat C-order positions in (D, H, W) of the occupied voxels of all grids,
            one grid after the other, ascending within a grid.
        values: (M,) floats, the measurement phi there (thesis 4.2.2); None if all are one.
        offsets: (B + 1,) int64, grid b holds rows offsets[b] to offsets[b + 1].
        shape: (D, H, W) of every grid: axes z, y, x.
    """

    index: np.ndarray
    values: np.ndarray | None
    offsets: np.ndarray
    shape: Shape

    def __post_init__(self) -> None:
        if not _well_formed(self.index, self.offsets, int(np.prod(self.shape))):
            raise ValueError(
                f"positions must be distinct, ascending within each grid and inside {self.shape}"
            )

    @classmethod
    def of_grids(
        cls,
        indices: Sequence[np.ndarray],
        values: Sequence[np.ndarray] | None,
        shape: Shape,
    ) -> Occupancy:
        """Gather grids given by flat C-order indices (M_b,) and their values (M_b,).

        Args:
            indices: each ascending and without duplicates.
            values: None if all are one.
            shape: (D, H, W) of every grid.

        Raises:
            ValueError: an index is out of order, duplicate or outside the grid.
        """
        offsets = np.zeros(len(indices) + 1, np.int64)
        np.cumsum([len(index) for index in indices], out=offsets[1:])
        index = np.concatenate([*indices, np.empty(0, np.int64)]).astype(np.int64, copy=False)
        joined = None
        if values is not None:
            joined = np.concatenate([np.asarray(v) for v in [*values, np.empty(0, np.float32)]])
        return cls(index, joined, offsets, shape)

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def n_voxels(self) -> int:
        """Number of voxels of all grids, empty ones included."""
        return len(self) * int(np.prod(self.shape))

    @cached_property
    def runs(self) -> Runs:
        """The same voxels in the form that the compiled loops take."""
        return runs_of(self.index, self.values, self.offsets, self.shape)

    def flat(self) -> np.ndarray:
        """(M,) int64 positions in a (B, D, H, W) volume."""
        grid = np.repeat(np.arange(len(self)), np.diff(self.offsets))
        return self.index + grid * int(np.prod(self.shape))

    def measured(self, values: np.ndarray) -> Occupancy:
        """The same grids with other measurements (M,), without the voxels where they are 0."""
        kept = values > 0
        before = np.concatenate([[0], np.cumsum(kept)])
        return Occupancy(self.index[kept], values[kept], before[self.offsets], self.shape)

    def plane_rows(self, flat: np.ndarray) -> np.ndarray:
        """(B * D + 1,) int64: ascending positions ``flat`` (N,) in (B, D, H, W) have their rows
        [p] to [p + 1] in plane p."""
        depth, height, width = self.shape
        return np.searchsorted(flat, np.arange(len(self) * depth + 1) * height * width)

    def dense(self, dtype: torch.dtype | None = None) -> Tensor:
        """(B, D, H, W) tensor of the grids, of the type of the values if ``dtype`` is None."""
        values = np.ones(len(self.index), np.float32) if self.values is None else self.values
        entries = torch.from_numpy(values).to(dtype)
        volume = torch.zeros(self.n_voxels, dtype=entries.dtype)
        volume[torch.from_numpy(self.flat())] = entries
        return volume.reshape(len(self), *self.shape)


@numba.njit(**COMPILED)
def _well_formed(index, offsets, n_voxels):  # pragma: no cover - compiled
    for b in range(len(offsets) - 1):
        before = -1
        for i in range(offsets[b], offsets[b + 1]):
            if index[i] <= before or index[i] >= n_voxels:
                return False
            before = index[i]
    return True
