"""What is known about occupied voxels, and the measurement phi that follows from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.core.errors import InputError
from scenenet.measurement.heights import heights
from scenenet.measurement.measurement import STEPS, MeasuredVoxels
from scenenet.measurement.registry import measurement_named


@dataclass(frozen=True)
class VoxelMeasures:
    """M occupied voxels, among all that are occupied around them.

    Attributes:
        zyx: (M, 3) positions on a lattice.
        count: (M,) number of points in each.
        total: (M,) int64, the sum of ``Measurement.point_steps`` over the points of each; None for
            a measurement that needs no field of the points.
        voxel_size: m.
        around: (K, 3) positions of all occupied voxels in the columns around them; None for the
            voxels themselves.
        fullest: number of points in the fullest voxel of the survey; None for that of these voxels.
    """

    zyx: np.ndarray
    count: np.ndarray
    total: np.ndarray | None
    voxel_size: float
    around: np.ndarray | None = None
    fullest: int | None = None

    def phi(self, measurement: str) -> np.ndarray:
        """The measurement at the voxels, (M,) float32 in [0, 1].

        Raises:
            InputError: there is no such measurement, a value is not in [0, 1], or the points were
                voxelised for another measurement.
        """
        measure, height, fullest = measurement_named(measurement), None, None
        if measure.fields and self.total is None:
            raise InputError(
                f"the voxels were made without {' and '.join(measure.fields)}, which measurement "
                f"{measurement!r} needs",
                remedy="Use scenenet train, evaluate or predict, which read it",
            )
        if "height" in measure.needs:
            around = self.zyx if self.around is None else self.around
            height = heights(self.zyx, around, self.voxel_size)
        if "fullest" in measure.needs:
            fullest = int(self.count.max(initial=1)) if self.fullest is None else self.fullest
        mean = None if self.total is None else self.total / (self.count.astype(np.int64) * STEPS)
        return measure.phi(MeasuredVoxels(self.count, mean, fullest, height))

    def in_blocks(self, row: np.ndarray, zyx: np.ndarray, voxel_size: float) -> VoxelMeasures:
        """The same of blocks of voxels.

        Args:
            row: (M,) row of the block of each voxel.
            zyx: (B, 3) positions of the blocks.
            voxel_size: m, edge of a block.
        """
        count, total = np.zeros(len(zyx), np.int64), None
        np.add.at(count, row, self.count)
        if self.total is not None:
            total = np.zeros(len(zyx), np.int64)
            np.add.at(total, row, self.total)
        return VoxelMeasures(zyx, count, total, voxel_size)
