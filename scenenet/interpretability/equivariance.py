"""Measures how equivariant a model is: whether its output moves with the scene (thesis 4.1, 4.4.1,
Eq. 3.1)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from scenenet.convolution.convolve import convolve
from scenenet.convolution.occupancy import Occupancy
from scenenet.core.errors import InputError
from scenenet.dataset.voxels import MAX_VOXELS, VoxelGrid, VoxelSample
from scenenet.interpretability.result import Turn
from scenenet.measurement.registry import measurement_named
from scenenet.pointcloud.point_fields import PointFields

if TYPE_CHECKING:
    from scenenet.models.base import VoxelModel

SHIFT = (2, 3, 5)
"""The measured translation, in whole voxels (z, y, x)."""


@dataclass(frozen=True)
class Scene:
    """Points centred on a vertical axis, and a grid that holds them at every rotation.

    Attributes:
        xyz: (N, 3) m, centred.
        grid: with the axis in the middle of a voxel column.
        measurement: phi of the voxels.
        steps: (N,) uint16, the value of each point (``Measurement.point_steps``), which it keeps
            when the scene moves; None for a measurement that needs no field of the points.
    """

    xyz: np.ndarray
    grid: VoxelGrid
    measurement: str
    steps: np.ndarray | None = None

    @classmethod
    def of(cls, points: np.ndarray, voxel_size: float, measurement: str) -> Scene:
        """The scene of points (N, 3) xyz, m. Fields that the measurement needs are random.

        Raises:
            InputError: there are no points, or the grid needs more than ``MAX_VOXELS`` voxels.
        """
        if len(points) == 0:
            raise InputError("there are no points to measure equivariance on")
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        xyz = points - middle
        radius = float(np.hypot(xyz[:, 0], xyz[:, 1]).max())
        # Odd, so that the axis is in the middle of a voxel; half a voxel larger than needed.
        n = 2 * math.ceil(radius / voxel_size + 0.5) + 1
        nz = 2 * math.ceil(float(xyz[:, 2].max()) / voxel_size + 0.5) + 1
        if float(n) * n * nz > MAX_VOXELS:
            raise InputError(
                f"a scene {2 * radius:.0f} m across needs more than {MAX_VOXELS} voxels of "
                f"{voxel_size:g} m",
                remedy="Use a smaller scene or larger voxels",
            )
        origin = (-n * voxel_size / 2, -n * voxel_size / 2, -nz * voxel_size / 2)
        grid, steps = VoxelGrid(origin, voxel_size, (nz, n, n)), None
        if (measure := measurement_named(measurement)).fields:
            fields = PointFields.random(len(xyz), measure.fields, np.random.default_rng(0))
            steps = measure.point_steps(fields)
        return cls(xyz, grid, measurement, steps)

    def voxelised(self, xyz: np.ndarray) -> tuple[Occupancy, np.ndarray]:
        """The points (N, 3) on the grid, and the flat voxel position (N,) of each point."""
        at = self.grid.voxel_of(np.ascontiguousarray(xyz))
        index, inverse, count = np.unique(at, return_inverse=True, return_counts=True)
        total = None
        if self.steps is not None:
            total = np.zeros(len(index), np.int64)
            np.add.at(total, inverse, self.steps)
        none = np.zeros(len(index), bool)
        sample = VoxelSample("", self.grid, index, count, none, total=total)
        return Occupancy.of_grids([index], [sample.phi(self.measurement)], self.grid.shape), at

    def turned(self, degrees: float) -> np.ndarray:
        """(N, 3) m, the points rotated about z."""
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        return self.xyz @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def sample_scene(seed: int = 0) -> np.ndarray:
    """(N, 3) xyz, m: a 15 m pole with an arm and two conductors, two trees, uneven ground."""
    rng = np.random.default_rng(seed)
    ground = rng.uniform(-20, 20, (6000, 2))
    bumps = 0.5 * np.sin(ground[:, 0] / 6) * np.cos(ground[:, 1] / 8)
    parts = [np.column_stack([ground, bumps])]
    parts.append(np.column_stack([rng.normal(0, 0.25, (400, 2)), rng.uniform(0, 15, 400)]))
    along = np.arange(-20, 20, 0.1)
    for side in (-2.0, 2.0):
        parts.append(np.column_stack([along, np.full(len(along), side), 13 + along**2 / 400]))
    arm = np.arange(-2.0, 2.0, 0.05)
    parts.append(np.column_stack([np.zeros(len(arm)), arm, np.full(len(arm), 14.0)]))
    for x, y, height in ((9.0, 8.0, 5.0), (-10.0, -7.0, 7.0)):
        crown = rng.normal(size=(600, 3)) * [1.5, 1.5, height / 5] + [x, y, height]
        parts.append(crown)
    return np.concatenate(parts)


def exact_errors(kernel: Tensor, scene: Scene) -> tuple[float, float]:
    """Errors of H under ``SHIFT`` and under the worst quarter turn, as shares of max |H|."""
    occupancy, _ = scene.voxelised(scene.xyz)
    observed = convolve(occupancy, kernel)[0]
    largest = float(observed.abs().max()) or 1.0
    dense = occupancy.dense()[0]
    # Padding on the high sides keeps the shifted scene inside the grid.
    (dz, dy, dx), (nz, ny, nx) = SHIFT, scene.grid.shape
    padded = torch.nn.functional.pad(dense, (0, dx, 0, dy, 0, dz))
    before = response(kernel, padded)
    after = response(kernel, torch.roll(padded, SHIFT, (0, 1, 2)))
    shifted = float((after[dz:, dy:, dx:] - before[:nz, :ny, :nx]).abs().max())
    quarters = [
        response(kernel, torch.rot90(dense, q, (1, 2))) - torch.rot90(observed, q, (1, 2))
        for q in (1, 2, 3)
    ]
    return shifted / largest, max(float(q.abs().max()) for q in quarters) / largest


def turns_of(
    model: VoxelModel, scene: Scene, angles: Sequence[float], tau: float | None
) -> tuple[Turn, tuple[Turn, ...]]:
    """Differences after a shift by half a voxel along x and y, and after a rotation by each of
    ``angles`` (degrees)."""
    observe = observed_by(model)

    def outputs(xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """H and M at the points, each (N,)."""
        occupancy, at = scene.voxelised(xyz)
        observed = observe(occupancy)
        probability = model(occupancy)
        return (
            observed.reshape(-1).numpy()[at].astype(float),
            probability.reshape(-1).numpy()[at].astype(float),
        )

    h0, m0 = outputs(scene.xyz)
    spread = float(h0.std()) or 1.0

    def compare(xyz: np.ndarray, degrees: float | None) -> Turn:
        h, m = outputs(xyz)
        otherwise = None
        if tau is not None and (either := (m >= tau) | (m0 >= tau)).any():
            otherwise = float(((m >= tau) != (m0 >= tau))[either].mean())
        difference = np.abs(m - m0)
        return Turn(
            degrees,
            float(np.abs(h - h0).mean() / spread),
            float(difference.mean()),
            float(difference.max()),
            otherwise,
        )

    half = scene.grid.voxel_size / 2 * np.array([1.0, 1.0, 0.0])
    shifted = compare(scene.xyz + half, None)
    return shifted, tuple(compare(scene.turned(angle), float(angle)) for angle in angles)


def observed_by(model: VoxelModel) -> Callable[[Occupancy], Tensor]:
    """A function from grids to H, (B, D, H, W). A model that is not linear answers at occupied
    voxels; H is 0 elsewhere."""
    if model.linear:
        kernel, bias = model.observer()
        return lambda occupancy: convolve(occupancy, kernel) + (0 if bias is None else bias)
    respond = model.responder()

    def observed(occupancy: Occupancy) -> Tensor:
        parts = respond(occupancy).sum(dim=0)
        volume = torch.zeros(occupancy.n_voxels, dtype=parts.dtype)
        volume[torch.from_numpy(occupancy.flat())] = parts
        return volume.reshape(len(occupancy), *occupancy.shape)

    return observed


def measured_errors(model: VoxelModel, scene: Scene) -> tuple[float, float]:
    """Errors of H under ``SHIFT`` and under the worst quarter turn, as shares of max |H|, from the
    model itself."""
    observe = observed_by(model)
    dense = scene.voxelised(scene.xyz)[0].dense()[0]

    def h(volume: Tensor) -> Tensor:
        return observe(_occupancy(volume))[0]

    (dz, dy, dx), (nz, ny, nx) = SHIFT, scene.grid.shape
    padded = torch.nn.functional.pad(dense, (0, dx, 0, dy, 0, dz))
    before, after = h(padded), h(torch.roll(padded, SHIFT, (0, 1, 2)))
    largest = float(before.abs().max()) or 1.0
    shifted = float((after[dz:, dy:, dx:] - before[:nz, :ny, :nx]).abs().max())
    still = h(dense)
    quarters = [h(torch.rot90(dense, q, (1, 2))) - torch.rot90(still, q, (1, 2)) for q in (1, 2, 3)]
    return shifted / largest, max(float(q.abs().max()) for q in quarters) / largest


def kernel_turn_error(kernel: Tensor) -> float:
    """max |k - k after a quarter turn| / max |k|; 1 if the box has no such symmetry."""
    _, ky, kx = kernel.shape
    if ky != kx or ky % 2 == 0:
        return 1.0
    largest = float(kernel.abs().max()) or 1.0
    return float((kernel - torch.rot90(kernel, 1, (1, 2))).abs().max()) / largest


def response(kernel: Tensor, dense: Tensor) -> Tensor:
    """The response (D, H, W) of ``kernel`` to a scene given as a volume (D, H, W)."""
    return convolve(_occupancy(dense), kernel)[0]


def _occupancy(dense: Tensor) -> Occupancy:
    """A volume (D, H, W) as a grid."""
    depth, height, width = dense.shape
    flat = dense.reshape(-1).numpy()
    occupied = np.flatnonzero(flat)
    return Occupancy.of_grids([occupied], [flat[occupied]], (depth, height, width))
