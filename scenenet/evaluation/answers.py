"""Answers for a crop: which points and voxels are tower, and where towers stand.

With the rules of tower detection the answer is the one that ``scenenet predict`` gives for the
crop, for any source of probabilities: a model, boosted trees, or a constant.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scenenet.dataset.crops import Crop
from scenenet.dataset.voxels import VoxelGrid, VoxelSample, voxelise
from scenenet.detection.detect import surroundings_in
from scenenet.detection.find import MeasuredTower, find_towers
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.crop_towers import places_of
from scenenet.pointcloud.cloud import PointCloud

Predict = Callable[[VoxelSample], tuple[np.ndarray, np.ndarray]]
"""Sample -> probabilities (V,) and labels (V,) bool of all voxels of its grid."""


@dataclass(frozen=True)
class LabelledCrop:
    """A crop as points and as voxels.

    Attributes:
        crop: its towers.
        cloud: its points.
        sample: its voxels, on the grid of the data set.
    """

    crop: Crop
    cloud: PointCloud
    sample: VoxelSample


@dataclass(frozen=True)
class Answer:
    """What is tower in a crop.

    Attributes:
        points: (N,) bool, of its points.
        voxels: (V,) bool, of the voxels of its grid.
        towers: (T, 4) m: x, y, elevation of the base and height of each tower, the last two NaN
            where they were not measured; None where no towers were looked for.
    """

    points: np.ndarray
    voxels: np.ndarray
    towers: np.ndarray | None

    @classmethod
    def of_points(
        cls, crop: LabelledCrop, points: np.ndarray, towers: np.ndarray | None = None
    ) -> Answer:
        """The answer with some points (N,) bool. A voxel with one of them is tower, as a voxel with
        a labelled point is labelled."""
        voxels = np.zeros(crop.sample.grid.n_voxels, bool)
        voxels[crop.sample.grid.voxel_of(crop.cloud.xyz[points])] = True
        return cls(points, voxels, towers)


def at_or_above_tau(crop: LabelledCrop, predict: Predict, tau: float) -> Answer:
    """The answer without rules: the voxels that reach tau, the points in them, and a tower for each
    group of voxels that touch."""
    probability, _ = predict(crop.sample)
    voxels = probability >= tau
    grid = crop.sample.grid
    towers = group_places(voxels.reshape(grid.shape), grid)
    return Answer(voxels[grid.voxel_of(crop.cloud.xyz)], voxels, towers)


def group_places(voxels: np.ndarray, grid: VoxelGrid) -> np.ndarray:
    """(T, 4) m, the mean position of each group of voxels (D, H, W) bool that touch at a face, an
    edge or a corner, as in ``Answer.towers``; base and height are NaN."""
    from scipy import ndimage

    groups, n = ndimage.label(voxels, structure=np.ones((3, 3, 3)))
    if n == 0:
        return np.empty((0, 4))
    zyx = np.array(ndimage.center_of_mass(voxels, groups, np.arange(1, n + 1)))
    xy = np.asarray(grid.origin[:2]) + (zyx[:, :0:-1] + 0.5) * grid.voxel_size
    return np.column_stack([xy, np.full((n, 2), np.nan)])


def with_rules(
    crop: LabelledCrop,
    predict: Predict,
    tau: float,
    voxel_size: float,
    detection: DetectionSettings,
) -> Answer:
    """The answer of ``scenenet predict`` for a crop as a survey of its own.

    Args:
        voxel_size: m, of the voxels in which the survey is predicted.
    """
    cloud = crop.cloud
    seen = voxelise(cloud, VoxelGrid.on_map(cloud.xyz, voxel_size), crop.sample.id)
    probability, _ = predict(seen)
    of_occupied = probability[seen.index]
    detected = of_occupied >= detection.threshold(tau)
    centres = seen.grid.centres(seen.index)
    towers = find_towers(
        centres[detected],
        of_occupied[detected],
        surroundings_in(centres),
        surroundings_in(cloud.xyz),
        voxel_size,
        tau,
        detection,
    )
    return Answer.of_points(crop, _own_points(cloud.xyz, towers), places_of(towers))


def _own_points(xyz: np.ndarray, towers: list[MeasuredTower]) -> np.ndarray:
    """(N,) bool, which points lie in the shape of a tower."""
    own = np.zeros(len(xyz), bool)
    for tower in towers:
        shape = tower.structure
        away = np.hypot(xyz[:, 0] - shape.x, xyz[:, 1] - shape.y)
        rows = np.flatnonzero(away <= shape.reach)
        own[rows[shape.contains(xyz[rows])]] = True
    return own
