"""From points to voxels: the grid, the measurement phi and the ground truth (thesis 4.2, 5.1.4)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import Field

from scenenet.core.errors import InputError
from scenenet.core.settings import Settings
from scenenet.dataset.voxel_measures import VoxelMeasures
from scenenet.measurement.registry import PRESENCE, measurement_named
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.targets import TOWER, Target

if TYPE_CHECKING:
    from scenenet.dataset.tower_shapes import TowerShape

Fit = Literal["cube", "metric"]

MAX_VOXELS = 2**28
"""Voxels of the largest grid allowed, 16 times as many as 256^3: its probabilities take 1 GiB."""


BORDER_M = 2.0**-21
"""A point this close below the border of a voxel, 0.5 micrometre, belongs to the voxel above. A
border is often a multiple of the steps of a file, and the sum of offset and steps then lands on
either side of it by rounding, so that another offset of the same survey would move the point."""

SMALLEST_VOXEL, LARGEST_VOXEL = 0.01, 1000.0
"""Edges that voxels can have, m."""


class VoxelSettings(Settings):
    """The grid of a crop."""

    fit: Fit = Field(
        "cube",
        description="cube: resolution^3 voxels over the bounding cube of the crop (thesis); "
        "metric: as many voxels of voxel_size as the crop needs",
    )
    resolution: Literal[32, 64, 128, 256] = Field(64, description="voxels per edge, for fit cube")
    voxel_size: float = Field(
        1.0,
        ge=SMALLEST_VOXEL,
        le=LARGEST_VOXEL,
        description="edge of a voxel in m, for fit metric",
    )

    def grid(self, xyz: np.ndarray) -> VoxelGrid:
        """The grid for points (N, 3)."""
        if self.fit == "cube":
            return VoxelGrid.cube(xyz, self.resolution)
        return VoxelGrid.metric(xyz, self.voxel_size)

    @property
    def label(self) -> str:
        """Name of the folder: cube-64, metric-0.9m."""
        return f"cube-{self.resolution}" if self.fit == "cube" else f"metric-{self.voxel_size:g}m"


@dataclass(frozen=True)
class VoxelGrid:
    """A regular grid of cubic voxels in map coordinates.

    Attributes:
        origin: (x, y, z) of the lowest corner, m.
        voxel_size: edge of a voxel, m.
        shape: (nz, ny, nx) voxels.
    """

    origin: tuple[float, float, float]
    voxel_size: float
    shape: tuple[int, int, int]

    @classmethod
    def cube(cls, xyz: np.ndarray, resolution: int) -> VoxelGrid:
        """resolution^3 voxels over the bounding cube of points (N, 3): each side of the bounding
        box is widened about its middle to the longest side, as in the published code.

        Points on a border are placed as that code places them, by rounding, without ``BORDER_M``.

        Raises:
            InputError: there are no points, all have the same coordinates, or the voxels would be
                smaller than ``SMALLEST_VOXEL`` or larger than ``LARGEST_VOXEL``.
        """
        low, high = _bounds(xyz)
        side = float((high - low).max())
        if side <= 0:
            raise InputError("all points have the same coordinates, so they have no bounding cube")
        voxel_size = side / resolution
        if not SMALLEST_VOXEL <= voxel_size <= LARGEST_VOXEL:
            raise InputError(
                f"{resolution} voxels over {side:g} m have edges of {voxel_size:.2g} m, which must "
                f"be {SMALLEST_VOXEL:g} to {LARGEST_VOXEL:g} m",
                remedy="Check that the coordinates are in metres, and choose another resolution",
            )
        origin = (low + high - side) / 2
        return cls(tuple(origin.tolist()), voxel_size, (resolution,) * 3)

    @classmethod
    def metric(cls, xyz: np.ndarray, voxel_size: float) -> VoxelGrid:
        """As many voxels of ``voxel_size`` (m) as points (N, 3) need, centred on their bounding
        box, and ``BORDER_M`` below it.

        Raises:
            InputError: there are no points, or they are too far apart.
        """
        low, high = _bounds(xyz)
        # Rounding must add no voxel to an extent of whole voxels: all borders would move.
        counts = np.maximum(1, np.ceil((high - low - BORDER_M) / voxel_size)).astype(int)
        _require_few(counts, voxel_size, high - low)
        origin = (low + high - counts * voxel_size) / 2 - BORDER_M
        return cls(tuple(origin.tolist()), float(voxel_size), tuple(counts[::-1].tolist()))

    @classmethod
    def on_map(cls, xyz: np.ndarray, voxel_size: float) -> VoxelGrid:
        """As many voxels of ``voxel_size`` (m) as points (N, 3) need, with borders at multiples of
        it in map coordinates, as ``scenenet.prediction.work.lattice`` places them.

        Raises:
            InputError: there are no points, or they are too far apart.
        """
        low, high = (np.floor((side + BORDER_M) / voxel_size) for side in _bounds(xyz))
        counts = (high - low + 1).astype(int)
        _require_few(counts, voxel_size, counts * voxel_size)
        origin = low * voxel_size - BORDER_M
        return cls(tuple(origin.tolist()), float(voxel_size), tuple(counts[::-1].tolist()))

    @property
    def n_voxels(self) -> int:
        return int(np.prod(self.shape))

    def voxel_of(self, xyz: np.ndarray) -> np.ndarray:
        """(N,) int64 flat C-order [z, y, x] index of the voxel of each point.

        Points on the upper border belong to the last voxel. Points outside are clipped to the grid;
        if the grid was made for these points, only rounding puts them outside.
        """
        from scenenet.dataset.voxel_counts import voxel_of

        nz, ny, nx = self.shape
        return voxel_of(xyz, np.asarray(self.origin, float), self.voxel_size, nz, ny, nx)

    def centres(self, index: np.ndarray) -> np.ndarray:
        """(M, 3) xyz of the centres of the voxels at flat ``index`` (M,), m."""
        z, y, x = np.unravel_index(index, self.shape)
        return np.asarray(self.origin) + (np.stack([x, y, z], axis=1) + 0.5) * self.voxel_size


@dataclass(frozen=True)
class VoxelSample:
    """A crop on its grid; only occupied voxels are stored.

    Attributes:
        id: name of the crop.
        grid: where the voxels lie.
        index: (M,) int32, flat C-order [z, y, x] positions of the occupied voxels, ascending.
        count: (M,) int32, number of points in each.
        labelled: (M,) bool, whether any of its points is labelled with the target: what a model
            learns.
        true: (M,) bool, whether any of its points is the target in truth; None where the truth is
            not known.
        shape: of the tower in the middle, as the points of the crop show it; None where they do
            not.
        total: (M,) int64, the sum of ``Measurement.point_steps`` over the points of each, for a
            measurement that needs fields of the points; else None.
    """

    id: str
    grid: VoxelGrid
    index: np.ndarray
    count: np.ndarray
    labelled: np.ndarray
    true: np.ndarray | None = None
    shape: TowerShape | None = None
    total: np.ndarray | None = None

    def phi(self, measurement: str) -> np.ndarray:
        """The measurement at the occupied voxels, (M,) float32 in [0, 1] (thesis 4.2.2, 5.3.2).

        Raises:
            InputError: there is no such measurement, or it does not lie in [0, 1].
        """
        return self.measures().phi(measurement)

    def measures(self) -> VoxelMeasures:
        """What is known about the occupied voxels, for measurements."""
        zyx = np.stack(np.unravel_index(self.index, self.grid.shape), axis=1)
        return VoxelMeasures(zyx, self.count, self.total, self.grid.voxel_size)

    def spread(self, occupied: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Probability (V,) float32 and label (V,) bool of every voxel of the grid, from the
        probability (M,) of the occupied ones; empty voxels have 0."""
        probability = np.zeros(self.grid.n_voxels, np.float32)
        probability[self.index] = occupied
        return probability, self.labels()

    def labels(self) -> np.ndarray:
        """(V,) bool: the voxels of the grid that are labelled with the target."""
        labelled = np.zeros(self.grid.n_voxels, bool)
        labelled[self.labelled_index()] = True
        return labelled

    def truth(self) -> np.ndarray | None:
        """(V,) bool: the voxels of the grid that are the target in truth; None where it is not
        known."""
        if self.true is None:
            return None
        true = np.zeros(self.grid.n_voxels, bool)
        true[self.index[self.true]] = True
        return true

    def labelled_by_truth(self) -> VoxelSample | None:
        """The same voxels with the truth as their labels; None where it is not known."""
        return None if self.true is None else replace(self, labelled=self.true)

    def labelled_index(self) -> np.ndarray:
        """(T,) flat positions of the labelled voxels."""
        return self.index[self.labelled]


def voxelise(
    cloud: PointCloud,
    grid: VoxelGrid,
    sample_id: str = "",
    target: Target = TOWER,
    measurement: str = PRESENCE,
) -> VoxelSample:
    """Count points and points labelled ``target`` in each voxel of ``grid``, those that are it in
    truth too if known, and sum up what ``measurement`` says about the points.

    Raises:
        InputError: the class scheme of the cloud is not known, or the measurement has a fault.
        ValueError: the cloud does not have the fields that the measurement needs.
    """
    from scenenet.dataset.voxel_counts import tally

    voxel = grid.voxel_of(cloud.xyz)
    index, count, labelled = tally(voxel, cloud.is_labelled(target), grid.n_voxels)
    true = None
    if (is_true := cloud.is_truly(target)) is not None:
        true = np.zeros(len(index), bool)
        true[np.searchsorted(index, voxel[is_true])] = True
    total = None
    if (measure := measurement_named(measurement)).fields:
        if cloud.fields is None:
            raise ValueError(f"the points were read without the fields of {measurement}")
        total = np.zeros(len(index), np.int64)
        np.add.at(total, np.searchsorted(index, voxel), measure.point_steps(cloud.fields))
    return VoxelSample(sample_id, grid, index, count, labelled, true, total=total)


def median_voxel_size(samples: Iterable[VoxelSample]) -> float:
    """m, the voxel size of a model that was trained on these samples."""
    return float(np.median([sample.grid.voxel_size for sample in samples]))


def _require_few(counts: np.ndarray, voxel_size: float, extent: np.ndarray) -> None:
    """Refuse a grid of ``counts`` (3,) voxels over ``extent`` (3,) m that needs too much memory."""
    if np.prod(counts.astype(float)) > MAX_VOXELS:
        sides = " x ".join(f"{side:.0f}" for side in extent)
        raise InputError(
            f"a grid over {sides} m needs more than {MAX_VOXELS} voxels of {voxel_size:g} m",
            remedy="Remove stray points, or use larger voxels",
        )


def _bounds(xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    if len(xyz) == 0:
        raise InputError("there are no points, so there is no grid")
    from scenenet.dataset.voxel_counts import extremes

    return extremes(xyz)
