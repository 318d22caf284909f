"""How far an operator's answer moves with the scene, whatever the operator is (thesis Eq. 3.1).

It measures the same differences as ``scenenet.interpretability.equivariance`` does for models, at
the occupied voxels of the answer alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scenenet.convolution.occupancy import Occupancy, Shape
from scenenet.interpretability.certificate import SCENE
from scenenet.interpretability.equivariance import SHIFT, Scene, sample_scene
from scenenet.interpretability.geneo_properties import ANGLES_DEG

Answers = Callable[[Occupancy], np.ndarray]
"""The answer (M,) of an operator at the occupied voxels of a grid."""


@dataclass(frozen=True)
class Equivariance:
    """How far the answer of an operator moves with the scene.

    Attributes:
        scene: describes the scene.
        translation: error under a shift by whole voxels, as a share of the largest answer.
        quarter_turn: the same for the worst quarter turn about z.
        between: mean difference at the points for the worst other angle, as a share of the standard
            deviation of the answer; ``between_degrees`` is that angle.
        half_voxel: the same for a shift by half a voxel, which moves points into other voxels as
            every angle does.
    """

    scene: str
    translation: float
    quarter_turn: float
    between: float
    between_degrees: float
    half_voxel: float


def measured_equivariance(answers: Answers, voxel_size: float) -> Equivariance:
    """The equivariance of an operator, on the scene of the certificates.

    Args:
        voxel_size: m, of the grid of the scene.

    Raises:
        InputError: the voxels are too small for the scene.
    """
    scene = Scene.of(sample_scene(), voxel_size, "presence")
    index, h0 = _at_points(answers, scene, scene.xyz)
    spread = float(h0.std()) or 1.0

    def difference(xyz: np.ndarray) -> float:
        return float(np.abs(_at_points(answers, scene, xyz)[1] - h0).mean() / spread)

    between = {angle: difference(scene.turned(angle)) for angle in ANGLES_DEG if angle % 90}
    worst = max(between, key=lambda angle: between[angle])
    cells = np.column_stack(np.unravel_index(index, scene.grid.shape))
    return Equivariance(
        scene=SCENE,
        translation=_error(answers, cells, scene.grid.shape, _shifted),
        quarter_turn=max(_error(answers, cells, scene.grid.shape, _quarters(n)) for n in (1, 2, 3)),
        between=between[worst],
        between_degrees=worst,
        half_voxel=difference(scene.xyz + voxel_size / 2 * np.array([1.0, 1.0, 0.0])),
    )


def _at_points(answers: Answers, scene: Scene, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The occupied voxels (M,), and the answer (N,) at points (N, 3) of the scene."""
    occupancy, at = scene.voxelised(xyz)
    rows = np.searchsorted(occupancy.index, at)
    return occupancy.index, answers(occupancy)[rows].astype(float)


_Move = Callable[[np.ndarray, Shape], tuple[np.ndarray, Shape]]
"""Moves voxels (M, 3) z, y, x of a grid into another grid."""


def _error(answers: Answers, cells: np.ndarray, shape: Shape, move: _Move) -> float:
    """The largest difference of the answer at moved voxels, as a share of its largest value."""
    before = answers(Occupancy.of_grids([_flat(cells, shape)], None, shape)).astype(float)
    moved, grid = move(cells, shape)
    index = _flat(moved, grid)
    order = np.argsort(index)
    after = np.empty_like(before)
    after[order] = answers(Occupancy.of_grids([index[order]], None, grid))
    return float(np.abs(after - before).max()) / (float(np.abs(before).max()) or 1.0)


def _flat(cells: np.ndarray, shape: Shape) -> np.ndarray:
    return np.ravel_multi_index(tuple(cells.T), shape)


def _shifted(cells: np.ndarray, shape: Shape) -> tuple[np.ndarray, Shape]:
    (dz, dy, dx), (nz, ny, nx) = SHIFT, shape
    return cells + SHIFT, (nz + dz, ny + dy, nx + dx)


def _quarters(turns: int) -> _Move:
    def turned(cells: np.ndarray, shape: Shape) -> tuple[np.ndarray, Shape]:
        """The grid of a scene is square."""
        angle = turns * math.pi / 2
        c, s = round(math.cos(angle)), round(math.sin(angle))
        middle = np.array([0, (shape[1] - 1) // 2, (shape[2] - 1) // 2])
        z, y, x = (cells - middle).T
        return np.column_stack([z, s * x + c * y, c * x - s * y]) + middle, shape

    return turned
